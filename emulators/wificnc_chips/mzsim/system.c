/* SPDX-License-Identifier: MIT
 * SYSKEY, oscillators, bus clocks, watchdog, resets and the core timer. */
#include "chip.h"

enum { WDT_ON = 1 << 15, RCON_SWR = 1 << 6, RCON_WDTO = 1 << 4 };
enum { OSCCON_PLL = 0x1100, OSCCON_BACKUP = 0x6100 | 1 << 3 /* CF */, RNMICON_CF = 1 << 17 };

#define WDT_CYCLES  ((uint64_t)MZ_CPU_HZ * 2048 / 1000) /* DEVCFG1.WDTPS = 1:2048 of 1 ms */
#define WDT_CLEAR   0x5743u
#define PBDIV_READY (1u << 11)

static void written_syskey(struct chip *chip, struct sfr *sfr, uint32_t before) {
    (void)before;
    if (sfr->value == 0xAA996655u)
        chip->syskey = 1;
    else
        chip->syskey = sfr->value == 0x556699AAu && chip->syskey == 1 ? 2 : 0;
}

uint32_t system_bus_cycles(const struct chip *chip, const struct sfr *pbdiv) {
    return ((pbdiv->value & 0x7F) + 1) * chip->speed;
}

uint32_t system_count(const struct chip *chip) {
    return (uint32_t)(chip->cycles / (2 * chip->speed));
}

void mz_cpu_speed(struct chip *chip, uint32_t factor) {
    chip->speed = factor;
}

static uint32_t read_pbdiv(struct chip *chip, struct sfr *sfr) {
    (void)chip;
    return sfr->value | PBDIV_READY;
}

/* SWRST does nothing until the register is read (Register 6-2). */
static uint32_t read_rswrst(struct chip *chip, struct sfr *sfr) {
    if ((sfr->value & 1) != 0)
        chip_restart(chip, RCON_SWR);
    return 0;
}

static void written_wdtcon(struct chip *chip, struct sfr *sfr, uint32_t before) {
    (void)before;
    if ((sfr->value & WDT_ON) == 0)
        chip->wdt_at = NEVER;
    else if (sfr->value >> 16 == WDT_CLEAR || chip->wdt_at == NEVER)
        chip->wdt_at = chip->cycles +
                       WDT_CYCLES * chip->speed / (system_is_on_backup(chip) ? MZ_CPU_HZ / MZ_BACKUP_HZ : 1);
    sfr->value &= 0xFFFFu;
}

void system_set_compare(struct chip *chip, uint32_t value) {
    uint64_t tick = 2 * chip->speed;
    uint32_t left = value - system_count(chip);
    chip->cpu.compare = value;
    chip->cpu.cause &= ~0x40000000u;
    chip->core_timer_at = (chip->cycles / tick + (left == 0 ? (uint64_t)1 << 32 : left)) * tick;
}

bool system_is_on_backup(const struct chip *chip) {
    return (chip->osccon->value & 0x7000u) == (OSCCON_BACKUP & 0x7000u);
}

/* The clock monitor (DEVCFG1.FCKSM). A clock that works again is used from the next reset on. */
void mz_oscillator(struct chip *chip, bool works) {
    const bool fails = chip->oscillator && !works;
    chip->oscillator = works;
    if (!fails)
        return;
    chip->osccon->value = OSCCON_BACKUP;
    chip->rnmicon->value |= RNMICON_CF;
    cpu_nmi(chip);
}

void system_create(struct chip *chip) {
    chip->oscillator = true;
    chip->osccon = sfr_add(chip, "OSCCON", 0x1F801200, OSCCON_PLL, 0);
    chip->rnmicon = sfr_add(chip, "RNMICON", 0x1F801260, 0, 0x03AB00FF);
    chip->cfgcon = sfr_add(chip, "CFGCON", 0x1F800000, 0x0000000B, 0x0003B7AF);
    struct sfr *syskey = sfr_add(chip, "SYSKEY", 0x1F800030, 0, 0xFFFFFFFF);
    chip->wdtcon = sfr_add(chip, "WDTCON", 0x1F800800, 0, 0xFFFF8001);
    chip->rcon = sfr_add(chip, "RCON", 0x1F801240, 3, 0xCC0003FF);
    chip->rswrst = sfr_add(chip, "RSWRST", 0x1F801250, 0, 1);
    chip->pb2div = sfr_add(chip, "PB2DIV", 0x1F801310, 0x8801, 0x807F);
    chip->pb3div = sfr_add(chip, "PB3DIV", 0x1F801320, 0x8801, 0x807F);
    struct sfr *u2rxr = sfr_add(chip, "U2RXR", 0x1F801470, 0, 0xF);
    struct sfr *u3rxr = sfr_add(chip, "U3RXR", 0x1F801478, 0, 0xF);
    (void)sfr_add(chip, "PRECON", 0x1F8E0000, 7, 0x37);
    syskey->written = written_syskey;
    syskey->plain = u2rxr->plain = u3rxr->plain = true;
    chip->wdtcon->written = written_wdtcon;
    chip->rswrst->read = read_rswrst;
    chip->pb2div->read = chip->pb3div->read = read_pbdiv;
    chip->cfgcon->locked = chip->rswrst->locked = chip->pb2div->locked = chip->pb3div->locked = true;
}

void system_reset(struct chip *chip) {
    if (!chip->oscillator)
        chip->osccon->value = OSCCON_BACKUP;
    chip->syskey = 0;
    chip->wdt_at = NEVER;
    chip->core_timer_at = NEVER;
}

uint64_t system_next(const struct chip *chip) {
    uint64_t next = chip->wdt_at < chip->core_timer_at ? chip->wdt_at : chip->core_timer_at;
    return chip->nvm.done_at < next ? chip->nvm.done_at : next;
}

void system_event(struct chip *chip) {
    nvm_event(chip);
    if (chip->core_timer_at <= chip->cycles) {
        chip->core_timer_at += (uint64_t)1 << 33;
        chip->cpu.cause |= 0x40000000u;
        evic_raise(chip, IRQ_CORE_TIMER);
    }
    if (chip->wdt_at <= chip->cycles)
        chip_restart(chip, RCON_WDTO);
}
