/* SPDX-License-Identifier: MIT
 * Timers 2 to 9 (type B, 16 bits) and the output compares on them: continuous pulses and PWM.
 *
 * The count goes 0 .. PR and back to 0; there the timer's interrupt comes. An output compare looks at the
 * count when it changes: it equals R, or RS. */
#include "chip.h"

#include <stdio.h>

enum { ON = 1 << 15, OCM_PULSES = 5, OCM_PWM = 6 };

static const uint32_t prescalers[8] = {1, 2, 4, 8, 16, 32, 64, 256};
static const uint8_t timer_irq[TIMERS] = {0, 0, 9, 14, 19, 24, 28, 32, 36, 40};
static const uint8_t compare_irq[COMPARES] = {0, 7, 12, 17, 22, 27, 31, 35, 39, 43};

static uint64_t cycles_a_tick(const struct chip *chip, const struct timer *timer) {
    return (uint64_t)prescalers[timer->con->value >> 4 & 7] * system_bus_cycles(chip, chip->pb3div);
}

static bool runs(const struct timer *timer) {
    return (timer->con->value & ON) != 0;
}

/* The timer of an output compare (Table 18-1), 0: none of ours. */
static unsigned timer_of(const struct chip *chip, unsigned number) {
    unsigned second = chip->compare[number].con->value >> 3 & 1;
    if ((chip->cfgcon->value >> 16 & 1) == 0)
        return 2 + second;
    return (number <= 3 ? 4 : number <= 6 ? 2 : 6) + second;
}

/* Ticks from the count `from` until it becomes `wanted`; it falls to 0 behind `period`, and at 2^16. */
static uint64_t ticks_until(uint32_t from, uint32_t wanted, uint32_t period) {
    if (wanted > from && (wanted <= period || from > period))
        return wanted - from;
    uint64_t to_zero = from <= period ? (uint64_t)period + 1 - from : (uint64_t)0x10000 - from;
    return wanted <= period ? to_zero + wanted : NEVER;
}

static uint32_t count_at(const struct chip *chip, const struct timer *timer, uint64_t cycle) {
    if (!runs(timer))
        return timer->from;
    return timer->from + (uint32_t)((cycle - timer->since) / cycles_a_tick(chip, timer));
}

static uint64_t soonest(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

static bool is_on(const struct chip *chip, unsigned number, unsigned timer) {
    const struct compare *compare = &chip->compare[number];
    return (compare->con->value & ON) != 0 && timer_of(chip, number) == timer;
}

/* When the count of a timer next does something. `from` and `since` are the present moment. */
static void plan(struct chip *chip, unsigned number) {
    struct timer *timer = &chip->timer[number];
    timer->next = NEVER;
    if (!runs(timer))
        return;
    uint32_t period = timer->pr->value & 0xFFFF;
    uint64_t ticks = ticks_until(timer->from, 0, period);
    for (unsigned i = 1; i < COMPARES; i++) {
        if (!is_on(chip, i, number))
            continue;
        ticks = soonest(ticks, ticks_until(timer->from, chip->compare[i].r->value & 0xFFFF, period));
        ticks = soonest(ticks, ticks_until(timer->from, chip->compare[i].rs->value & 0xFFFF, period));
    }
    timer->next = timer->since + ticks * cycles_a_tick(chip, timer);
}

/* The present moment becomes the one from which the count is known; the part of a tick is kept. */
static void rebase(struct chip *chip, unsigned number) {
    struct timer *timer = &chip->timer[number];
    if (runs(timer)) {
        uint64_t tick = cycles_a_tick(chip, timer), gone = (chip->cycles - timer->since) / tick;
        timer->from += (uint32_t)gone;
        timer->since += gone * tick;
    } else {
        timer->since = chip->cycles;
    }
}

static void drive(struct chip *chip, unsigned number, bool high) {
    /* RPD5R and RPE3R: the two that our board knows, Table 12-22 */
    static const struct {
        uint8_t compare, pin;
        uint16_t slot;
    } routes[] = {{1, 16 * 3 + 5, 0x15D4 / 16}, {8, 16 * 4 + 3, 0x160C / 16}};
    chip->compare[number].high = high;
    for (unsigned i = 0; i < 2; i++)
        if (routes[i].compare == number)
            port_function(chip, routes[i].pin, high);
}

/* The count has just become `count`. */
static void compare_event(struct chip *chip, unsigned number, uint32_t count) {
    struct compare *compare = &chip->compare[number];
    uint32_t mode = compare->con->value & 7;
    if (mode == OCM_PULSES && count == (compare->r->value & 0xFFFF))
        drive(chip, number, true);
    if (mode == OCM_PULSES && count == (compare->rs->value & 0xFFFF)) {
        drive(chip, number, false);
        evic_raise(chip, compare_irq[number]);
    }
    if (mode == OCM_PWM && count == 0) {
        compare->r->value = compare->rs->value;
        drive(chip, number, compare->r->value != 0);
    } else if (mode == OCM_PWM && count == (compare->r->value & 0xFFFF)) {
        drive(chip, number, false);
    }
}

static void happen(struct chip *chip, unsigned number) {
    struct timer *timer = &chip->timer[number];
    uint64_t ticks = (timer->next - timer->since) / cycles_a_tick(chip, timer);
    uint32_t period = timer->pr->value & 0xFFFF, count = timer->from + (uint32_t)ticks;
    bool matched = count > period && timer->from <= period;
    timer->since = timer->next;
    timer->from = count > period && (matched || count == 0x10000) ? 0 : count;
    if (matched)
        evic_raise(chip, timer_irq[number]);
    for (unsigned i = 1; i < COMPARES; i++)
        if (is_on(chip, i, number))
            compare_event(chip, i, timer->from);
    plan(chip, number);
}

uint64_t timers_next(const struct chip *chip) {
    uint64_t next = NEVER;
    for (unsigned i = 2; i < TIMERS; i++)
        next = soonest(next, chip->timer[i].next);
    return next;
}

void timers_event(struct chip *chip) {
    for (unsigned i = 2; i < TIMERS; i++)
        while (chip->timer[i].next <= chip->cycles)
            happen(chip, i);
}

/* ---- registers ---- */

static void written_con(struct chip *chip, struct sfr *sfr, uint32_t before) {
    struct timer *timer = &chip->timer[sfr->unit];
    uint32_t now = sfr->value;
    if ((now & 0xA) != 0)
        chip_fault(chip, "%s = %08x: 32-bit timers and outer clocks are not modelled", sfr->name, now);
    sfr->value = before;
    rebase(chip, sfr->unit);
    sfr->value = now;
    if ((before & ON) == 0)
        timer->since = chip->cycles;
    plan(chip, sfr->unit);
}

static void written_tmr(struct chip *chip, struct sfr *sfr, uint32_t before) {
    struct timer *timer = &chip->timer[sfr->unit];
    (void)before;
    rebase(chip, sfr->unit);
    timer->from = sfr->value;
    timer->since = chip->cycles;
    plan(chip, sfr->unit);
}

static uint32_t read_tmr(struct chip *chip, struct sfr *sfr) {
    return count_at(chip, &chip->timer[sfr->unit], chip->cycles);
}

static void written_pr(struct chip *chip, struct sfr *sfr, uint32_t before) {
    (void)before;
    rebase(chip, sfr->unit);
    plan(chip, sfr->unit);
}

static void written_compare(struct chip *chip, struct sfr *sfr, uint32_t before) {
    uint32_t mode = chip->compare[sfr->unit].con->value & 7;
    (void)before;
    if ((chip->compare[sfr->unit].con->value & ON) != 0 && mode != OCM_PULSES && mode != OCM_PWM)
        chip_fault(chip, "OC%u: mode %u is not modelled", sfr->unit, mode);
    for (unsigned i = 2; i < TIMERS; i++) {
        rebase(chip, i);
        plan(chip, i);
    }
}

static struct sfr *add(struct chip *chip, const char *pattern, unsigned unit, uint32_t address,
                       uint32_t at_reset, void (*written)(struct chip *, struct sfr *, uint32_t)) {
    char name[12];
    snprintf(name, sizeof name, pattern, unit);
    struct sfr *sfr = sfr_add(chip, name, address, at_reset, 0xFFFF);
    sfr->unit = unit;
    sfr->written = written;
    return sfr;
}

void timers_create(struct chip *chip) {
    for (unsigned i = 2; i < TIMERS; i++) {
        struct timer *timer = &chip->timer[i];
        uint32_t base = 0x1F840000 + 0x200 * (i - 1);
        timer->con = add(chip, "T%uCON", i, base, 0, written_con);
        timer->tmr = add(chip, "TMR%u", i, base + 0x10, 0, written_tmr);
        timer->tmr->read = read_tmr;
        timer->pr = add(chip, "PR%u", i, base + 0x20, 0xFFFF, written_pr);
    }
    for (unsigned i = 1; i < COMPARES; i++) {
        struct compare *compare = &chip->compare[i];
        uint32_t base = 0x1F844000 + 0x200 * (i - 1);
        compare->con = add(chip, "OC%uCON", i, base, 0, written_compare);
        compare->r = add(chip, "OC%uR", i, base + 0x10, 0, written_compare);
        compare->rs = add(chip, "OC%uRS", i, base + 0x20, 0, written_compare);
    }
}

void timers_reset(struct chip *chip) {
    for (unsigned i = 2; i < TIMERS; i++) {
        chip->timer[i].from = 0;
        chip->timer[i].since = chip->cycles;
        chip->timer[i].next = NEVER;
    }
    for (unsigned i = 1; i < COMPARES; i++)
        chip->compare[i].high = false;
}
