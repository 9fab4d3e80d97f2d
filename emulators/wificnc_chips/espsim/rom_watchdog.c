/* SPDX-License-Identifier: MIT
 * The S3's functions of the boot ROM that set watchdogs up, as ESP-IDF's hal/wdt_hal.h describes them. */
#include "rom.h"

enum { RTC_DOG, GROUP_0, GROUP_1, DOGS };             /* wdt_inst_t */
enum { RESET_SYSTEM = 3, RESET_RTC = 4, STAGES = 4 }; /* wdt_stage_action_t */
enum { GROUP_INT_ENA = 0x70, GROUP_INT_CLR = 0x7C, GROUP_DOG = 1 << 2 };
enum { RTC_PAUSES = 1 << 9, RTC_FLASHBOOT = 1 << 12, GROUP_FLASHBOOT = 1 << 14 };
enum { RTC_RESETS = 3 << 10, GROUP_RESETS = 3 << 12 }; /* both cores */
#define ENABLE (1u << 31)
#define KEY    0x50D83AA1u

static const uint32_t registers[DOGS] = {0x60008000, 0x6001F000, 0x60020000};

/* What wdt_hal_context_t is for. @return false: it is no such one */
static bool number_of(struct esp *esp, uint32_t context, unsigned *number) {
    const uint32_t which = bus_load(esp, context, 4);
    if (which >= DOGS) {
        chip_fault(esp, "the boot ROM is to set up the watchdog %u, which there is not", which);
        return false;
    }
    *number = which == RTC_DOG ? WATCHDOG_RTC : which - GROUP_0;
    return true;
}

static uint32_t config_of(const struct esp *esp, unsigned number) {
    return watchdog_load(esp, number, 0);
}

static unsigned feed_word(unsigned number) {
    return number == WATCHDOG_RTC ? 5 : 6;
}

static void set_interrupt(struct esp *esp, unsigned number, bool on) {
    if (number == WATCHDOG_RTC)
        return; /* it makes none here */
    const uint32_t group = registers[GROUP_0 + number], enabled = bus_load(esp, group + GROUP_INT_ENA, 4);
    bus_store(esp, group + GROUP_INT_CLR, GROUP_DOG, 4);
    bus_store(esp, group + GROUP_INT_ENA, on ? enabled | GROUP_DOG : enabled & ~(uint32_t)GROUP_DOG, 4);
}

/* Disabled, all stages off, locked. */
void rom_dog_init(struct esp *esp, uint32_t context, uint32_t which, uint32_t prescaler, bool interrupts) {
    unsigned number;
    bus_store(esp, context, which, 4);
    if (!number_of(esp, context, &number))
        return;
    bus_store(esp, context + 4, registers[which], 4);
    watchdog_store(esp, number, feed_word(number) + 1, KEY);
    watchdog_store(esp, number, 0, number == WATCHDOG_RTC ? RTC_RESETS | RTC_PAUSES : GROUP_RESETS);
    if (number != WATCHDOG_RTC)
        watchdog_store(esp, number, 1, prescaler << 16);
    set_interrupt(esp, number, interrupts);
    watchdog_store(esp, number, feed_word(number) + 1, 0);
}

/* The RTC's first stage is doubled by the chip. */
void rom_dog_stage(struct esp *esp, uint32_t context, uint32_t stage, uint32_t ticks, uint32_t action) {
    unsigned number;
    if (!number_of(esp, context, &number))
        return;
    const bool is_rtc = number == WATCHDOG_RTC;
    if (stage >= STAGES || action > (is_rtc ? RESET_RTC : RESET_SYSTEM)) {
        chip_fault(esp, "the boot ROM is to give stage %u of a watchdog the action %u", stage, action);
        return;
    }
    const unsigned shift = is_rtc ? 28 - 3 * stage : 29 - 2 * stage;
    const uint32_t mask = (is_rtc ? 7u : 3u) << shift;
    watchdog_store(esp, number, (is_rtc ? 1 : 2) + stage, is_rtc && stage == 0 ? ticks >> 1 : ticks);
    watchdog_store(esp, number, 0, (config_of(esp, number) & ~mask) | action << shift);
}

void rom_dog_lock(struct esp *esp, uint32_t context, bool on) {
    unsigned number;
    if (number_of(esp, context, &number))
        watchdog_store(esp, number, feed_word(number) + 1, on ? 0 : KEY);
}

void rom_dog_feed(struct esp *esp, uint32_t context) {
    unsigned number;
    if (number_of(esp, context, &number))
        watchdog_store(esp, number, feed_word(number), 1);
}

static void set_bits(struct esp *esp, uint32_t context, uint32_t of_group, uint32_t of_rtc, bool on) {
    unsigned number;
    if (!number_of(esp, context, &number))
        return;
    const uint32_t bits = number == WATCHDOG_RTC ? of_rtc : of_group, config = config_of(esp, number);
    watchdog_store(esp, number, 0, on ? config | bits : config & ~bits);
}

void rom_dog_enable(struct esp *esp, uint32_t context, bool on) {
    if (on)
        rom_dog_feed(esp, context);
    set_bits(esp, context, ENABLE, ENABLE, on);
}

/* It has no effect here: nothing starts from a flash that is broken. */
void rom_dog_flashboot(struct esp *esp, uint32_t context, bool on) {
    set_bits(esp, context, GROUP_FLASHBOOT, RTC_FLASHBOOT, on);
}

void rom_dog_handle(struct esp *esp, uint32_t context) {
    unsigned number;
    if (!number_of(esp, context, &number))
        return;
    rom_dog_feed(esp, context);
    if (number != WATCHDOG_RTC)
        bus_store(esp, registers[GROUP_0 + number] + GROUP_INT_CLR, GROUP_DOG, 4);
}

uint32_t rom_dog_is_enabled(struct esp *esp, uint32_t context) {
    unsigned number;
    return number_of(esp, context, &number) && (config_of(esp, number) & ENABLE) != 0;
}
