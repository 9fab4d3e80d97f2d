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
 * position. */
#ifndef WIFICNC_STEP_SPAN_H
#define WIFICNC_STEP_SPAN_H

#include "base/axis.h"
#include "base/ring.h"
#include "config.h"

enum { SPAN_WORDS = 3, SPAN_PHASE_BITS = 15, SPAN_PHASE_ONE = 1 << SPAN_PHASE_BITS };

/** Longest mean interval of a span. With a ramp of 9/8 the longest one still fits Q16.16 ticks in 32 bits.
 * Slower motion is made of events without a step. */
#define SPAN_MAX_INTERVAL_TICKS 57000u

enum span_flags {
    SPAN_AT_REST = 0x200,     /* motion rests after it: running dry here is no under-run */
    SPAN_SEGMENT_MASK = 0xFF, /* low byte: enum segment_flags of the segment */
};

/** 72 bytes. */
struct span {
    uint32_t phase[SPAN_WORDS];     /* at the start */
    uint32_t increment[SPAN_WORDS]; /* per event */
    uint32_t interval_q16;          /* ticks from the event before to the first event */
    int32_t delta_q16;              /* change of the interval from event to event */
    uint32_t events;                /* > 0 */
    uint32_t ticks;                 /* duration, whole ticks */
    uint16_t flags;                 /* enum span_flags */
    axis_mask_t negative;           /* axes that move in negative direction */
    int32_t position[AXIS_COUNT];   /* steps, before the first event */
    uint32_t line;                  /* source line */
};

/** Spans between prep (task) and the step ISR. */
struct span_ring {
    struct ring index;
    struct span slots[SPAN_RING_SIZE];
};

/** Half word of an axis in span.phase and span.increment. */
static inline unsigned span_word(unsigned axis) {
    return axis / 2u;
}
static inline unsigned span_shift(unsigned axis) {
    return axis % 2u * 16u;
}

#endif
