/* SPDX-License-Identifier: MIT
 * The real vector (targets/esp32/hal/step_vector.S), step_interrupt() and step ISR above a program with
 * register windows: recursion of all three window sizes, loops, shifts, the multiplier's accumulator,
 * compare-and-swap. The interrupt comes at any instruction, of the window handlers, too; what the program
 * computes must be what it computes alone, and the pulses what the position says. */
#include "hal/step_vector.h"
#include "step_pins.h"

#include "hal/hal_step.h"

enum { SPANS = 1000, LEVEL5_TIMER = 1u << 13 };
enum { FAULT_WORK = 1, FAULT_ATOMIC, FAULT_POSITION, FAULT_END, FAULT_FEW, FAULT_NO_WINDOW };

struct emulated emulated = {.random = 1, .least_cycles = 120, .spread_mask = 255};
timg_dev_t timer_group;
gpio_dev_t gpio;
mcpwm_dev_t MCPWM0;

static struct hal_step hal;
static struct step step;

uint32_t sum_by_4(uint32_t n);
uint32_t sum_by_12(uint32_t n);
uint32_t loops(uint32_t n);
uint32_t accumulates(uint32_t n);

/* The compiler calls them. */
void *memset(void *to, int value, __SIZE_TYPE__ count) {
    for (volatile char *at = to; count > 0; count--)
        *at++ = (char)value;
    return to;
}

void *memcpy(void *restrict to, const void *restrict from, __SIZE_TYPE__ count) {
    volatile char *at = to;
    for (const char *next = from; count > 0; count--)
        *at++ = *next++;
    return to;
}

/* ---- the program ---- */

static uint32_t __attribute__((noinline)) tree(uint32_t depth, uint32_t seed) {
    if (depth == 0)
        return seed * 2654435761u;
    const uint32_t left = tree(depth - 1, seed << (depth & 7) ^ seed >> (depth & 3));
    return left ^ tree(depth - 1, seed + left) << (left & 15);
}

static uint32_t work(uint32_t seed) {
    return tree(6, seed) ^ sum_by_4(40 + (seed & 31)) << 3 ^ sum_by_12(20 + (seed & 15)) ^
           loops(30 + (seed & 7)) << 7 ^ accumulates(9 + (seed & 3));
}

static bool counts_right(void) {
    static uint32_t counter;
    const uint32_t before = counter;
    for (unsigned n = 0; n < 50; n++)
        (void)__atomic_fetch_add(&counter, 3, __ATOMIC_SEQ_CST);
    return counter == before + 150;
}

/* ---- motion ---- */

static void fill(struct span *span, uint32_t index, uint32_t random) {
    const uint32_t events = 3 + (random & 31);
    span->events = events;
    span->at = (0x10000u - events) << 16 | index;
    span->interval_q16 = 10u << 16;
    span->delta_q16 = 0;
    span->negative = (axis_mask_t)(random >> 8 & 63);
    for (unsigned word = 0; word < SPAN_WORDS; word++) {
        span->phase[word] = 0x40004000u;
        span->increment[word] = word == 2 && (random & 0x100000) == 0 ? 0 : (random >> word & 0x7FFF7FFFu);
    }
}

/* What a span adds to the position of the next. */
static void place(struct span *next, const struct span *span) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        const uint32_t phase = span->phase[span_word(ax)] >> span_shift(ax) & 0x7FFF;
        const uint32_t increment = span->increment[span_word(ax)] >> span_shift(ax) & 0xFFFF;
        const int32_t steps = (int32_t)((phase + span->events * increment) >> SPAN_PHASE_BITS);
        next->position[ax] = span->position[ax] + ((span->negative >> ax & 1) != 0 ? -steps : steps);
    }
}

static bool position_is_that_of_the_pulses(void) {
    int32_t position[AXIS_COUNT], before[AXIS_COUNT], after[AXIS_COUNT];
    uint32_t spans;
    do { /* no change of direction in between */
        spans = __atomic_load_n(&step.spans_done, __ATOMIC_ACQUIRE);
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            before[ax] = emulated.steps[ax];
        step_position(&step, position);
        (void)emulated_cycles();
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            after[ax] = emulated.steps[ax];
    } while (spans != __atomic_load_n(&step.spans_done, __ATOMIC_ACQUIRE));
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        const int32_t low = before[ax] < after[ax] ? before[ax] : after[ax];
        const int32_t high = before[ax] < after[ax] ? after[ax] : before[ax];
        if (position[ax] < low - 1 || position[ax] > high + 1)
            return false;
    }
    return true;
}

static bool position_is_exact_at_rest(void) {
    int32_t position[AXIS_COUNT];
    (void)emulated_gpio(); /* what was written last */
    step_position(&step, position);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if (position[ax] != emulated.steps[ax])
            return false;
    return true;
}

static void interrupts(bool on) {
    __asm__ volatile("wsr %0, intenable\n\trsync" ::"r"(on ? LEVEL5_TIMER : 0) : "memory");
}

/* The chain is two spans long, and joined as prep does it: by compare-and-swap with the ISR's exchange. */
static void give(struct span *span) {
    static struct span *newest;
    struct span *none = 0;
    newest = newest == 0 ? step.span : newest;
    place(span, newest);
    span->next = 0;
    if (!__atomic_compare_exchange_n(&newest->next, &none, span, false, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE))
        step_start(&step, span);
    newest = span;
}

static struct span *free_span(uint32_t number) {
    return &step.pool[1 + number % (SPAN_POOL_SIZE - 1)];
}

static int run(uint32_t alone[64]) {
    uint32_t random = 12345;
    for (uint32_t n = 0; n < SPANS; n++) {
        while (n >= 2 && __atomic_load_n(&step.spans_done, __ATOMIC_ACQUIRE) + 1 < n) {
        }
        struct span *span = free_span(n);
        random = random * 1664525u + 1013904223u;
        fill(span, (uint32_t)(span - step.pool), random);
        give(span);
        if (work(n & 63) != alone[n & 63])
            return FAULT_WORK;
        if (!counts_right())
            return FAULT_ATOMIC;
        if (!position_is_that_of_the_pulses())
            return FAULT_POSITION;
    }
    while (step.active) {
    }
    return position_is_exact_at_rest() ? 0 : FAULT_END;
}

int main(void) {
    static const uint8_t step_gpio[AXIS_COUNT] = {0, 1, 2, 3, 4, 5},
                         dir_gpio[AXIS_COUNT] = {8, 9, 10, 11, 12, 13};
    uint32_t alone[64];
    interrupts(false);
    for (uint32_t n = 0; n < 64; n++)
        alone[n] = work(n);
    const struct gang gang = gang_of(AXIS_COUNT, 0);
    if (!step_pins_set(&hal.pins, &gang, step_gpio, dir_gpio))
        return FAULT_END;
    hal.step_lines = step_pins_bits(step_gpio, AXIS_MASKS - 1);
    step_init(&step, &hal);
    step_vector_argument = &step;
    (void)emulated_timer_group();
    interrupts(true);
    const int fault = run(alone);
    if (fault != 0)
        return fault;
    if (emulated.looks < 10 * SPANS)
        return FAULT_FEW;
    return emulated.looks_from_windows < 1000 ? FAULT_NO_WINDOW : 0;
}
