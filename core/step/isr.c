/* SPDX-License-Identifier: MIT
 * Spans -> step edges. Additions, masks and compares only: no division, no float, no loop over axes. */
#include "step/isr.h"

#include "hal/hal_step.h"

#define PHASE_MASK 0x7FFF7FFFu
#define CARRY_MASK 0x80008000u

/* Advance two axes by one event. */
static HAL_INLINE uint32_t next_word(struct step *step, unsigned word) {
    uint32_t sum = (step->phase[word] & PHASE_MASK) + step->increment[word];
    step->phase[word] = sum;
    return sum & CARRY_MASK;
}

/* Advance all phases by one event; the axes that overflow are the step bits: of each word, bit 15 becomes the
 * lower one and bit 31 the upper one. Above bit 7 is rubbish. */
static HAL_INLINE axis_mask_t next_bits(struct step *step) {
    uint32_t xy = next_word(step, 0), za = next_word(step, 1);
    uint32_t carries = xy >> 2 | za;
    if (step->increment[2] != 0) { /* B or C moves */
        carries = carries >> 2 | next_word(step, 2);
        return (axis_mask_t)(carries >> 11 | carries >> 26);
    }
    return (axis_mask_t)(carries >> 13 | carries >> 28);
}

static HAL_INLINE uint32_t next_ticks(struct step *step) {
    uint32_t sum = step->interval_q16 + step->fraction_q16;
    step->interval_q16 += (uint32_t)step->delta_q16;
    step->fraction_q16 = (uint16_t)sum;
    return sum >> 16;
}

/* Make this span the current one. The word `at` is stored last, with release: whoever reads it finds the span
 * complete, and the span before is given back by it. @return ticks to its first event. */
static HAL_INLINE uint32_t load_span(struct step *step, struct span *span) {
    step->span = span;
    step->phase[0] = span->phase[0];
    step->phase[1] = span->phase[1];
    step->phase[2] = span->phase[2];
    step->increment[0] = span->increment[0];
    step->increment[1] = span->increment[1];
    step->increment[2] = span->increment[2];
    step->interval_q16 = span->interval_q16;
    step->delta_q16 = span->delta_q16;
    step->watch_probe = (span->flags & SEGMENT_PROBE) != 0 && !step->probe_hit;
    __atomic_store_n(&step->at, span->at, __ATOMIC_RELEASE);
    hal_step_span(step->hal, span->flags, span->line);
    step->next = next_bits(step);
    return next_ticks(step);
}

/* The current span is done: go on with the next, or rest. From the exchange on prep cannot change any more
 * what follows this span. */
HAL_ISR HAL_SELDOM static void next_span(struct step *step) {
    struct hal_step *hal = step->hal;
    __atomic_store_n(&step->spans_done, step->spans_done + 1, __ATOMIC_RELEASE);
    struct span *span = __atomic_exchange_n(&step->span->next, step->span, __ATOMIC_ACQ_REL);
    if (span == 0) {
        hal_step_timer_stop(hal);
        step->active = false;
        hal_step_clear(hal);
        return;
    }
    hal_step_timer_next(hal, load_span(step, span));
    hal_step_clear(hal);
    hal_step_direction(hal, span->negative);
}

/* Remember where the probe closes; the task slows the motion down. */
static HAL_INLINE void look_at_probe(struct step *step) {
    if (!hal_step_probe(step->hal))
        return;
    step->probe_span = *step->span;
    step->probe_done = step->span->events - span_left(step->at);
    step->watch_probe = false;
    step->probe_hit = true;
}

static HAL_INLINE void put_event(struct step *step) {
    struct hal_step *hal = step->hal;
    hal_step_set(hal, step->next);
    uint32_t at;
    bool ends = __builtin_add_overflow(step->at, STEP_AT_EVENT, &at);
    __atomic_store_n(&step->at, at, __ATOMIC_RELAXED);
    if (ends) {
        next_span(step);
        return;
    }
    hal_step_timer_next(hal, next_ticks(step));
    step->next = next_bits(step);
    hal_step_clear(hal);
}

HAL_ISR HAL_SELDOM static void put_probing_event(struct step *step) {
    look_at_probe(step);
    put_event(step);
}

HAL_ISR void step_isr(struct step *step) {
    if (step->watch_probe)
        put_probing_event(step);
    else
        put_event(step);
}

void step_init(struct step *step, struct hal_step *hal) {
    *step = (struct step){.hal = hal};
    for (uint32_t i = 0; i < SPAN_POOL_SIZE; i++)
        step->pool[i].at = i;
    step->pool[0].next = &step->pool[0];
    step->span = &step->pool[0];
}

void step_start(struct step *step, struct span *span) {
    step->fraction_q16 = 0;
    uint32_t ticks = load_span(step, span);
    hal_step_direction(step->hal, span->negative);
    step->active = true;
    hal_step_timer_start(step->hal, ticks);
}

void step_halt(struct step *step) {
    step->halted = true;
    hal_step_timer_stop(step->hal);
    step->active = false;
}

bool step_only_waits(const struct step *step) {
    const struct span *span = step->span;
    if (span->next == span) /* it was left: nothing follows */
        return false;
    uint32_t any = 0;
    for (; span != 0; span = span->next)
        for (unsigned word = 0; word < SPAN_WORDS; word++)
            any |= span->increment[word];
    return any == 0;
}

bool step_is_cut(const struct step *step) {
    return step->halted && step->span->next != step->span;
}

void step_stand(struct step *step, struct span *span) {
    step->span = span;
    __atomic_store_n(&step->spans_done, step->spans_done + 1, __ATOMIC_RELEASE);
    __atomic_store_n(&step->at, span->at, __ATOMIC_RELEASE);
    step->halted = false;
}
