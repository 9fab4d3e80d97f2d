/* SPDX-License-Identifier: MIT
 * The S3's system timer: two counters of 16 MHz and 52 bits, three alarms, at a time or in periods. Stalls of
 * counters by stalled cores are not emulated. */
#include "esp.h"

#include <string.h>

enum {
    CONFIG = 0x00,
    UNIT_OP = 0x04,
    LOAD_VALUE = 0x0C,
    TARGET = 0x1C,
    TARGET_CONFIG = 0x34,
    VALUE = 0x40,
    TARGET_APPLY = 0x50,
    UNIT_APPLY = 0x5C,
    ENABLE = 0x64,
    RAW = 0x68,
    CLEAR = 0x6C,
    MASKED = 0x70,
    SIZE = 0x100,
};
enum { CYCLES = ES_CPU_HZ / 16000000, UNITS = 2, ALARMS = 3, FIRST_SOURCE = 57, PERIOD_BITS = 26 };
#define PERIODIC  (1u << 30)
#define UPDATE    (1u << 30)
#define VALID     (1u << 29)
#define HIGH_BITS 0xFFFFFu
#define APPLY     1u

static bool counts(const struct systimer *timer, unsigned unit) {
    return (timer->config >> (30 - unit) & 1) != 0;
}

static uint64_t count_of(const struct esp *esp, unsigned unit) {
    const struct systimer *timer = &esp->systimer;
    return timer->from[unit] + (counts(timer, unit) ? (esp->cycles - timer->since[unit]) / CYCLES : 0);
}

static unsigned unit_of(const struct systimer *timer, unsigned alarm) {
    return timer->target_config[alarm] >> 31;
}

/* The next match, or none. @param from  the cycle from which on a period counts */
static void schedule(struct esp *esp, unsigned alarm, uint64_t from) {
    struct systimer *timer = &esp->systimer;
    const unsigned unit = unit_of(timer, alarm);
    const uint64_t target = (uint64_t)timer->target[alarm][0] << 32 | timer->target[alarm][1];
    const uint64_t period = timer->target_config[alarm] & ((1u << PERIOD_BITS) - 1);
    timer->alarm_at[alarm] = NEVER;
    if ((timer->config >> (24 - alarm) & 1u) != 0 && counts(timer, unit)) {
        const uint64_t start = timer->from[unit];
        uint64_t at = timer->since[unit] + (target > start ? target - start : 0) * CYCLES;
        if ((timer->target_config[alarm] & PERIODIC) != 0)
            at = from + (period == 0 ? 1 : period) * CYCLES;
        timer->alarm_at[alarm] = at > esp->cycles ? at : esp->cycles;
    }
    chip_look(esp);
}

static void set_lines(struct esp *esp) {
    for (unsigned i = 0; i < ALARMS; i++)
        matrix_set(esp, FIRST_SOURCE + i, (esp->systimer.raw & esp->systimer.enabled & 1u << i) != 0);
}

static void set_count(struct esp *esp, unsigned unit, uint64_t count) {
    esp->systimer.from[unit] = count;
    esp->systimer.since[unit] = esp->cycles;
}

/* ---- registers ---- */

static void configure(struct esp *esp, uint32_t value) {
    struct systimer *timer = &esp->systimer;
    const uint32_t before = timer->config;
    for (unsigned unit = 0; unit < UNITS; unit++)
        set_count(esp, unit, count_of(esp, unit));
    timer->config = value;
    for (unsigned alarm = 0; alarm < ALARMS; alarm++)
        if (((before ^ value) >> (24 - alarm) & 1) != 0 || ((before ^ value) >> 29 & 3) != 0)
            schedule(esp, alarm, esp->cycles);
}

static void latch(struct esp *esp, unsigned unit) {
    const uint64_t count = count_of(esp, unit);
    esp->systimer.value[unit][0] = (uint32_t)(count >> 32) & HIGH_BITS;
    esp->systimer.value[unit][1] = (uint32_t)count;
}

static void apply_unit(struct esp *esp, unsigned unit) {
    const uint32_t *load = esp->systimer.load[unit];
    set_count(esp, unit, (uint64_t)load[0] << 32 | load[1]);
    for (unsigned alarm = 0; alarm < ALARMS; alarm++)
        if (unit_of(&esp->systimer, alarm) == unit)
            schedule(esp, alarm, esp->cycles);
}

/* An alarm that works changes between a time and periods, which begin then; a new period is for the next
 * APPLY. */
static void configure_target(struct esp *esp, unsigned alarm, uint32_t value) {
    uint32_t *config = &esp->systimer.target_config[alarm];
    const bool changes = ((*config ^ value) & PERIODIC) != 0;
    *config = value;
    if (changes)
        schedule(esp, alarm, esp->cycles);
}

static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    struct systimer *timer = &esp->systimer;
    if (offset == CONFIG)
        configure(esp, value);
    else if (offset - UNIT_OP < 4 * UNITS && (value & UPDATE) != 0)
        latch(esp, (offset - UNIT_OP) / 4);
    else if (offset - LOAD_VALUE < 8 * UNITS)
        timer->load[(offset - LOAD_VALUE) / 8][(offset - LOAD_VALUE) / 4 % 2] = value;
    else if (offset - TARGET < 8 * ALARMS)
        timer->target[(offset - TARGET) / 8][(offset - TARGET) / 4 % 2] = value;
    else if (offset - TARGET_CONFIG < 4 * ALARMS)
        configure_target(esp, (offset - TARGET_CONFIG) / 4, value);
    else if (offset - TARGET_APPLY < 4 * ALARMS && (value & APPLY) != 0)
        schedule(esp, (offset - TARGET_APPLY) / 4, esp->cycles);
    else if (offset - UNIT_APPLY < 4 * UNITS && (value & APPLY) != 0)
        apply_unit(esp, (offset - UNIT_APPLY) / 4);
    else if (offset == ENABLE)
        timer->enabled = value;
    else if (offset == CLEAR)
        timer->raw &= ~value;
    set_lines(esp);
}

static uint32_t load(struct esp *esp, uint32_t offset) {
    const struct systimer *timer = &esp->systimer;
    if (offset == CONFIG)
        return timer->config;
    if (offset - UNIT_OP < 4 * UNITS)
        return VALID;
    if (offset - LOAD_VALUE < 8 * UNITS)
        return timer->load[(offset - LOAD_VALUE) / 8][(offset - LOAD_VALUE) / 4 % 2];
    if (offset - TARGET < 8 * ALARMS)
        return timer->target[(offset - TARGET) / 8][(offset - TARGET) / 4 % 2];
    if (offset - TARGET_CONFIG < 4 * ALARMS)
        return timer->target_config[(offset - TARGET_CONFIG) / 4];
    if (offset - VALUE < 8 * UNITS)
        return timer->value[(offset - VALUE) / 8][(offset - VALUE) / 4 % 2];
    return offset == ENABLE   ? timer->enabled
           : offset == RAW    ? timer->raw
           : offset == MASKED ? timer->raw & timer->enabled
                              : 0;
}

/* Unit 0 counts from reset on. */
void systimer_create(struct esp *esp) {
    struct systimer *timer = &esp->systimer;
    memset(timer, 0, sizeof *timer);
    timer->config = 1u << 30;
    for (unsigned unit = 0; unit < UNITS; unit++)
        timer->since[unit] = esp->cycles;
    for (unsigned alarm = 0; alarm < ALARMS; alarm++)
        timer->alarm_at[alarm] = NEVER;
    if (esp->chip == ES_ESP32S3)
        bus_add(esp, &(struct block){"systimer", 0x60023000, SIZE, load, store, NULL});
}

uint64_t systimer_next(const struct esp *esp) {
    uint64_t next = NEVER;
    for (unsigned i = 0; i < ALARMS; i++)
        next = esp->systimer.alarm_at[i] < next ? esp->systimer.alarm_at[i] : next;
    return next;
}

void systimer_event(struct esp *esp) {
    struct systimer *timer = &esp->systimer;
    for (unsigned i = 0; i < ALARMS; i++) {
        const uint64_t at = timer->alarm_at[i];
        if (at > esp->cycles)
            continue;
        timer->raw |= 1u << i;
        timer->alarm_at[i] = NEVER;
        if ((timer->target_config[i] & PERIODIC) != 0)
            schedule(esp, i, at);
        set_lines(esp);
    }
}
