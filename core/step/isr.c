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

/* Make this span, at the ring's tail, the current one. @return ticks to its first event. */
static HAL_INLINE uint32_t load_span(struct step *step, const struct span *span) {
    step->span = span;
    step->phase[0] = span->phase[0];
    step->phase[1] = span->phase[1];
    step->phase[2] = span->phase[2];
    step->increment[0] = span->increment[0];
    step->increment[1] = span->increment[1];
    step->increment[2] = span->increment[2];
    step->interval_q16 = span->interval_q16;
    step->delta_q16 = span->delta_q16;
    step->events_left = span->events;
    step->watch_probe = (span->flags & SEGMENT_PROBE) != 0 && !step->probe_hit;
    hal_step_span(step->hal, span->flags, span->line);
    step->next = next_bits(step);
    return next_ticks(step);
}

/* The current span is done: go on with the next, or rest. */
HAL_ISR HAL_SELDOM static void next_span(struct step *step) {
    struct hal_step *hal = step->hal;
    const struct span *span = step->span;
    uint16_t flags = span->flags;
    step->spans_done++;
    step->ticks_done += span->ticks;
    if (ring_pop(&step->ring.index) == 0) {
        hal_step_timer_stop(hal);
        step->active = false;
        step->loaded = false;
        step->underruns += (flags & SPAN_AT_REST) == 0;
        hal_step_clear(hal);
        return;
    }
    span = span == &step->ring.slots[SPAN_RING_SIZE - 1] ? step->ring.slots : span + 1;
    hal_step_timer_next(hal, load_span(step, span));
    hal_step_clear(hal);
    hal_step_direction(hal, span->negative);
}

/* Remember where the probe closes; the task slows the motion down. */
static HAL_INLINE void look_at_probe(struct step *step) {
    if (!hal_step_probe(step->hal))
        return;
    step->probe_span = *step->span;
    step->probe_left = step->events_left;
    step->watch_probe = false;
    step->probe_hit = true;
}

static HAL_INLINE void put_event(struct step *step) {
    struct hal_step *hal = step->hal;
    hal_step_set(hal, step->next);
    if (--step->events_left == 0) {
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
}

void step_start(struct step *step) {
    if (step->active || step->halted || ring_held(&step->ring.index) == 0)
        return;
    step->fraction_q16 = 0;
    const struct span *span = &step->ring.slots[step->ring.index.tail & (SPAN_RING_SIZE - 1)];
    uint32_t ticks = load_span(step, span);
    step->loaded = true;
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
    uint32_t tail = step->ring.index.tail;
    uint32_t any = 0;
    for (uint32_t at = tail; at != step->ring.index.head; at++) {
        for (unsigned word = 0; word < SPAN_WORDS; word++)
            any |= step->ring.slots[at & (SPAN_RING_SIZE - 1)].increment[word];
    }
    return tail != step->ring.index.head && any == 0;
}

void step_flush(struct step *step) {
    step->halted = false;
    step->loaded = false;
    while (step->ring.index.tail != step->ring.index.head)
        step->ticks_done += step->ring.slots[step->ring.index.tail++ & (SPAN_RING_SIZE - 1)].ticks;
}
