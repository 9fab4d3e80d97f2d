/* SPDX-License-Identifier: MIT
 * Spans -> step edges. Additions, masks and compares only: no division, no float, no loop over axes, and no
 * call of another file: where the ISR has a calling convention of its own (ESP32), this file alone is
 * compiled for it. */
#include "step/load.h"

/* The current span is done: continue with the next, or rest. From the exchange on prep cannot change any more
 * what follows this span. */
HAL_ISR HAL_SELDOM static void next_span(struct step *step) {
    struct hal_step *hal = step->hal;
    /* First: step_look() relies on this count to change before `at` names another span. */
    __atomic_store_n(&step->spans_done, step->spans_done + 1, __ATOMIC_RELEASE);
    /* The span's own address says that the ISR has left it: prep's compare-and-swap then fails. */
    struct span *span = __atomic_exchange_n(&step->span->next, step->span, __ATOMIC_ACQ_REL);
    if (span == 0) {
        hal_step_timer_stop(hal);
        step->active = false;
        if (step->beam == STEP_BEAM_ALLOWED)
            hal_step_duty(hal, step->dark);
        hal_step_clear(hal);
        return;
    }
    hal_step_timer_next(hal, load_span(step, span));
    hal_step_clear(hal);
    hal_step_direction(hal, span->negative);
}

_Static_assert(SPAN_WORDS == 3 && AXIS_COUNT == 6, "keep_span() copies each of them");

/* What step_probe_position() needs of a span, word by word: a copy of the structure is a call of memcpy(). */
static HAL_INLINE void keep_span(struct span *to, const struct span *from) {
    to->phase[0] = from->phase[0];
    to->phase[1] = from->phase[1];
    to->phase[2] = from->phase[2];
    to->increment[0] = from->increment[0];
    to->increment[1] = from->increment[1];
    to->increment[2] = from->increment[2];
    to->position[0] = from->position[0];
    to->position[1] = from->position[1];
    to->position[2] = from->position[2];
    to->position[3] = from->position[3];
    to->position[4] = from->position[4];
    to->position[5] = from->position[5];
    to->negative = from->negative;
}

/* Remember where the probe closes; the task slows the motion down. */
static HAL_INLINE void look_at_probe(struct step *step) {
    if (!hal_step_probe(step->hal))
        return;
    keep_span(&step->probe_span, step->span);
    step->probe_done = step->span->events - span_left(step->at);
    step->watch_probe = false;
    step->probe_hit = true;
}

static HAL_INLINE void put_event(struct step *step) {
    struct hal_step *hal = step->hal;
    /* First of all: the edge comes the same time after the interrupt, whatever follows. */
    hal_step_set(hal, step->next);
    uint32_t at;
    /* The high half is minus the events left, so it overflows to 0 with the last one. */
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
