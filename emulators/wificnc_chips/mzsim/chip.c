/* SPDX-License-Identifier: MIT
 * The chip as a whole: time, power and resets. */
#include "chip.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void chip_fault(struct chip *chip, const char *format, ...) {
    if (chip->stop == MZ_FAULT)
        return;
    va_list words;
    va_start(words, format);
    vsnprintf(chip->fault, sizeof chip->fault, format, words);
    va_end(words);
    chip->stop = MZ_FAULT;
    chip->limit = 0;
}

void chip_look(struct chip *chip) {
    chip->look = true;
    chip->limit = 0;
}

/* Room for `count` elements. A buffer that cannot grow stops the chip: no edge and no byte may be missing. */
bool chip_grow(void *array, size_t *room, size_t count, size_t size) {
    void **at = array;
    if (count <= *room)
        return true;
    size_t wanted = 2 * count + 1024;
    void *grown = realloc(*at, wanted * size);
    if (grown == NULL)
        abort();
    *at = grown;
    *room = wanted;
    return true;
}

static bool allocate(struct chip *chip) {
    chip->ram = calloc(1, RAM_SIZE);
    chip->flash = malloc(MZ_FLASH_SIZE);
    chip->boot = malloc(BOOT_SIZE);
    chip->ops = calloc(MZ_FLASH_SIZE / 4 + 1, sizeof *chip->ops);
    if (chip->ram == NULL || chip->flash == NULL || chip->boot == NULL || chip->ops == NULL)
        return false;
    chip->ops[MZ_FLASH_SIZE / 4].kind = OP_LEAVE;
    memset(chip->flash, 0xFF, MZ_FLASH_SIZE);
    memset(chip->boot, 0xFF, BOOT_SIZE);
    return true;
}

struct chip *mz_create(void) {
    struct chip *chip = calloc(1, sizeof *chip);
    if (chip == NULL || !allocate(chip)) {
        mz_destroy(chip);
        return NULL;
    }
    chip->speed = 1;
    evic_create(chip);
    system_create(chip);
    timers_create(chip);
    uart_create(chip);
    nvm_create(chip);
    port_create(chip);
    bench_create(chip);
    mz_reset(chip);
    return chip;
}

void mz_destroy(struct chip *chip) {
    if (chip == NULL)
        return;
    free(chip->ram);
    free(chip->flash);
    free(chip->boot);
    free(chip->ops);
    free(chip->edges);
    free(chip->uart.in);
    free(chip->uart.out);
    free(chip->bus.in);
    free(chip->bus.out);
    free(chip->bench.steps);
    free(chip);
}

/* Where a piece of an image goes, or NULL. */
static uint8_t *flash_at(struct chip *chip, uint32_t address, size_t count) {
    if (address - FLASH_BASE < MZ_FLASH_SIZE && count <= MZ_FLASH_SIZE - (address - FLASH_BASE))
        return (uint8_t *)chip->flash + (address - FLASH_BASE);
    if (address - BOOT_BASE < BOOT_SIZE && count <= BOOT_SIZE - (address - BOOT_BASE))
        return (uint8_t *)chip->boot + (address - BOOT_BASE);
    return NULL;
}

bool mz_program(struct chip *chip, uint32_t address, const uint8_t *bytes, size_t count) {
    uint8_t *at = flash_at(chip, address, count);
    if (at == NULL)
        return false;
    memcpy(at, bytes, count);
    if (address - FLASH_BASE < MZ_FLASH_SIZE)
        chip_flash_changed(chip, address - FLASH_BASE, count);
    return true;
}

/* @param offset, count  of the bytes, both from the beginning of the flash */
void chip_flash_changed(struct chip *chip, uint32_t offset, size_t count) {
    for (size_t word = offset / 4; word < (offset + count + 3) / 4; word++)
        chip->ops[word].kind = OP_UNKNOWN;
}

const uint8_t *mz_flash(const struct chip *chip) {
    return (const uint8_t *)chip->flash;
}

enum { RCON_POR = 1 << 0, RCON_BOR = 1 << 1 };

static void reset(struct chip *chip, uint32_t why) {
    const uint32_t causes = (why & RCON_POR) != 0 ? 0 : chip->rcon->value; /* until they are cleared */
    sfr_reset(chip);
    chip->rcon->value = causes | why;
    cpu_reset(chip);
    system_reset(chip);
    timers_reset(chip);
    uart_reset(chip);
    nvm_reset(chip);
    for (unsigned port = 0; port < PORTS; port++)
        port_update(chip, port);
    port_reset(chip);
    chip_look(chip);
}

void mz_reset(struct chip *chip) {
    chip->stop = MZ_TIME;
    chip->fault[0] = '\0';
    reset(chip, RCON_POR | RCON_BOR);
}

void mz_reset_by(struct chip *chip, uint32_t causes) {
    chip->resets++;
    reset(chip, causes);
}

void chip_restart(struct chip *chip, uint32_t why) {
    chip->resets++;
    reset(chip, why);
    chip->cpu.broken = true; /* the present instruction is no more */
}

/* ---- time ---- */

static uint64_t soonest(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

static uint64_t next_drive(const struct chip *chip) {
    return chip->drive_count > 0 ? chip->drives[chip->drive_count - 1].cycle : NEVER;
}

static void drive_due(struct chip *chip) {
    while (next_drive(chip) <= chip->cycles) {
        struct drive drive = chip->drives[--chip->drive_count];
        mz_pin_drive(chip, drive.pin, drive.level);
    }
}

bool mz_pin_drive_at(struct chip *chip, uint64_t cycle, unsigned pin, int level) {
    if (chip->drive_count == DRIVES_MAX || pin >= MZ_PIN_COUNT)
        return false;
    unsigned at = chip->drive_count++;
    for (; at > 0 && chip->drives[at - 1].cycle <= cycle; at--)
        chip->drives[at] = chip->drives[at - 1];
    chip->drives[at] = (struct drive){.cycle = cycle, .pin = (uint8_t)pin, .level = (int8_t)level};
    chip_look(chip);
    return true;
}

static void events(struct chip *chip) {
    timers_event(chip);
    uart_event(chip);
    system_event(chip);
    drive_due(chip);
    chip->look = true;
}

/* An access to a register sees all that was before it: an instruction may have taken longer than the next
 * event was away. */
void chip_catch_up(struct chip *chip) {
    if (chip->cycles < chip->next_event)
        return;
    events(chip);
    chip_look(chip);
}

static void look_around(struct chip *chip) {
    evic_update(chip);
    chip->next_event = soonest(soonest(timers_next(chip), uart_next(chip)), system_next(chip));
    chip->next_event = soonest(chip->next_event, next_drive(chip));
    chip->look = false;
}

/* An interrupt asks, and the CPU lets it. */
static bool is_interrupted(const struct chip *chip) {
    uint32_t status = chip->cpu.status;
    return (status & (STATUS_IE | STATUS_EXL | STATUS_ERL)) == STATUS_IE && chip->level > (status >> 10 & 63);
}

/* WAIT ends when an interrupt asks at a higher level than the CPU's, be it let in or not. */
static void sleep_on(struct chip *chip, uint64_t until) {
    if (chip->level > (chip->cpu.status >> 10 & 63)) {
        chip->cpu.waits = false;
        return;
    }
    uint64_t to = soonest(chip->next_event, until);
    if (to > chip->cycles) {
        chip->asleep += to - chip->cycles;
        chip->cycles = to;
    }
}

static void go_on(struct chip *chip, uint64_t until) {
    if (chip->cycles >= chip->next_event)
        events(chip);
    if (chip->look)
        look_around(chip);
    bool interrupted = is_interrupted(chip);
    if (interrupted && !chip->cpu.slot)
        cpu_interrupt(chip);
    else if (chip->cpu.waits)
        sleep_on(chip, until);
    if (chip->cpu.waits || chip->stop != MZ_TIME)
        return;
    chip->limit = interrupted ? chip->cycles + 1 : soonest(chip->next_event, until);
    cpu_run(chip);
}

enum mz_stop mz_run(struct chip *chip, uint64_t until_cycle) {
    while (chip->stop == MZ_TIME && chip->cycles < until_cycle)
        go_on(chip, until_cycle);
    return chip->stop;
}

enum mz_stop mz_step(struct chip *chip) {
    return mz_run(chip, chip->cycles + 1);
}

uint64_t mz_cycles(const struct chip *chip) {
    return chip->cycles;
}

uint64_t mz_instructions(const struct chip *chip) {
    return chip->cycles - chip->asleep;
}

const char *mz_fault(const struct chip *chip) {
    return chip->fault;
}

uint32_t mz_resets(const struct chip *chip) {
    return chip->resets;
}

void mz_vector(const struct chip *chip, unsigned irq, struct mz_vector *out) {
    *out = irq < IRQ_COUNT ? chip->vectors[irq] : (struct mz_vector){0, 0, 0};
}

/* ---- for tests ---- */

void mz_cpu_get(const struct chip *chip, struct mz_cpu *out) {
    const struct cpu *cpu = &chip->cpu;
    *out = (struct mz_cpu){
        .hi = cpu->hi, .lo = cpu->lo, .pc = cpu->pc, .next_pc = cpu->next_pc, .fcsr = cpu->fcsr};
    memcpy(out->r, cpu->r, sizeof out->r);
    memcpy(out->f, cpu->f, sizeof out->f);
}

void mz_cpu_set(struct chip *chip, const struct mz_cpu *in) {
    struct cpu *cpu = &chip->cpu;
    memcpy(cpu->r, in->r, sizeof in->r);
    memcpy(cpu->f, in->f, sizeof in->f);
    cpu->hi = in->hi;
    cpu->lo = in->lo;
    cpu->pc = in->pc;
    cpu->next_pc = in->next_pc;
    cpu->fcsr = in->fcsr;
    cpu->slot = false;
    cpu->status = STATUS_CU1 | STATUS_FR;
}

bool mz_ram_write(struct chip *chip, uint32_t physical, const uint8_t *bytes, size_t count) {
    if (physical > RAM_SIZE || count > RAM_SIZE - physical)
        return false;
    memcpy((uint8_t *)chip->ram + physical, bytes, count);
    return true;
}

bool mz_ram_read(const struct chip *chip, uint32_t physical, uint8_t *bytes, size_t count) {
    if (physical > RAM_SIZE || count > RAM_SIZE - physical)
        return false;
    memcpy(bytes, (const uint8_t *)chip->ram + physical, count);
    return true;
}

uint32_t mz_sfr_read(struct chip *chip, uint32_t address) {
    return bus_load(chip, address, 4);
}

void mz_sfr_write(struct chip *chip, uint32_t address, uint32_t value) {
    bus_store(chip, address, value, 4);
}
