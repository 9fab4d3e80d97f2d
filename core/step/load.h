/* SPDX-License-Identifier: MIT
 * The next event of a span, and the first one: what the step ISR and the start of motion share. */
#ifndef WIFICNC_STEP_LOAD_H
#define WIFICNC_STEP_LOAD_H

#include "hal/hal_step.h"
#include "step/isr.h"

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

/* Ticks to the next event. Intervals are Q16.16; the fraction of a tick that the timer cannot wait is
 * carried to the event after it. */
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
    if (step->beam == STEP_BEAM_ALLOWED)
        hal_step_duty(step->hal, span->duty);
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

#endif
