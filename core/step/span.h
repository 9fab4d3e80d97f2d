/* SPDX-License-Identifier: MIT
 * The span: a run of step-timer events so simple that the ISR only adds and compares.
 *
 * Event e (0 .. events-1) comes interval + e*delta after the event before it. At each event every axis adds
 * its increment to its phase; an axis whose 15-bit phase overflows steps. The six phases live in three words,
 * two axes a word, so that one addition serves two axes and one mask collects their carries:
 *
 *     word   bit 31        30..16        15            14..0
 *     0      carry of Y    phase of Y    carry of X    phase of X
 *     1      carry of A    phase of A    carry of Z    phase of Z
 *     2      carry of C    phase of C    carry of B    phase of B
 *
 * Most spans move neither B nor C, and word 2 is left alone.
 *
 * An increment of 0x8000 steps at every event, 0 never. An axis that travels s steps in E events has the
 * increment s 2^15 / E, rounded; the rounding adds up to at most E/2 < 2^13, so the start phase (or the
 * increment by one) can be chosen so that the number of overflows is exact (step/prep.c).
 *
 * Nothing else is state: the position at any instant is span.position plus the overflows of the events done,
 * in closed form (step_position()), so the ISR keeps no counters and a stop at any event leaves an exact
 * position.
 *
 * Spans come from a pool and form a chain, linked by `next`. The chain always ends at rest. To change what
 * follows a span that is still ahead, prep builds the new end of the chain next to the old one and swaps one
 * pointer (step/prep.h). The ISR takes the pointer out with an atomic exchange when it leaves the span, so
 * exactly one of both happens first: the ISR follows the old end, or the new one. */
#ifndef WIFICNC_STEP_SPAN_H
#define WIFICNC_STEP_SPAN_H

#include "base/axis.h"
#include "config.h"

#include <stdint.h>

enum { SPAN_WORDS = 3, SPAN_PHASE_BITS = 15, SPAN_PHASE_ONE = 1 << SPAN_PHASE_BITS };

/** Longest mean interval of a span. With a ramp of 9/8 the longest one still fits Q16.16 ticks in 32 bits.
 * Slower motion is made of events without a step. */
#define SPAN_MAX_INTERVAL_TICKS 57000u

enum span_flags {
    SPAN_AT_REST = 0x200,     /* motion rests after it: what is left of its time is waited */
    SPAN_SEGMENT_MASK = 0xFF, /* low byte: enum segment_flags of the segment */
};

struct span {
    uint32_t phase[SPAN_WORDS];     /* at the start */
    uint32_t increment[SPAN_WORDS]; /* per event */
    uint32_t interval_q16;          /* ticks from the event before to the first event */
    int32_t delta_q16;              /* change of the interval from event to event */
    uint32_t events;                /* > 0, below 2^16; 0: motion was reset here */
    uint32_t at;                    /* step.at when the span begins: minus events << 16, index in the pool */
    uint16_t flags;                 /* enum span_flags */
    uint16_t duty;                  /* of a laser, as its PWM's register has it */
    axis_mask_t negative;           /* axes that move in negative direction */
    int32_t position[AXIS_COUNT];   /* steps, before the first event */
    uint32_t line;                  /* source line */
    uint32_t end_us;                /* motion time at the end of its segment */
    uint32_t v_um_s;                /* path speed there */
    struct span *next;  /* shared with the step ISR: what follows; NULL: rest; itself: the ISR has left it */
    struct span *after; /* [motion] the same for prep, which the ISR does not touch */
    uint32_t made;      /* [motion] number of the span; 0: it is free */
};

/** Events not yet put out that step.at says. */
static inline uint32_t span_left(uint32_t at) {
    return (0x10000u - (at >> 16)) & 0xFFFFu;
}

/** Half word of an axis in span.phase and span.increment. */
static inline unsigned span_word(unsigned axis) {
    return axis / 2u;
}
static inline unsigned span_shift(unsigned axis) {
    return axis % 2u * 16u;
}

#endif
