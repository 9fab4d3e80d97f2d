/* SPDX-License-Identifier: MIT
 * Segments -> spans. [motion side: a task on the ISR's core, or the main loop]
 *
 * Within a segment the speed is linear in time, so v^2 is linear in distance, and the times of all events are
 * known in closed form. Events are the dominant axis' steps, or equal parts of them. A segment need not begin
 * and end on one: the time from its last event to its end goes into the first interval of the next segment,
 * so steps keep their pace across segments. A span makes its intervals linear in the event count. Over a
 * stretch whose speed changes by the ratio q that is wrong by less than ((q-1)/(q+1))^2 / 10 of the stretch's
 * time, so prep cuts the segment where q passes 9/8: below 0.04 %, and the cut points themselves and the end
 * are exact. */
#ifndef WIFICNC_STEP_PREP_H
#define WIFICNC_STEP_PREP_H

#include "segment/ring.h"
#include "step/isr.h"

/** How far prep runs ahead of the step ISR; two spans at least. */
#define PREP_AHEAD_US 2000u

/** What the board fixes, in ticks of its step timer. */
struct prep_timing {
    uint32_t timer_hz;
    uint32_t min_interval_ticks; /* pulse and the same low time: no two events closer */
    uint32_t dir_setup_ticks;    /* added where a direction line changes */
};

struct prep {
    struct segment_ring *in;
    struct step *step;
    struct prep_timing timing;
    int32_t position[AXIS_COUNT]; /* steps at the end of all spans made so far */
    uint64_t tick_remainder;      /* of the last segment, in 1/1e9 tick */
    /* the segment being cut; ticks in Q16.16, distances in events */
    bool loaded;
    uint16_t flags;
    uint32_t line;
    axis_mask_t negative, last_negative;
    uint32_t phase[SPAN_WORDS], increment[SPAN_WORDS];
    uint32_t events, done; /* of the segment */
    float first;           /* from the start of the segment to its first event, 0 .. 1 */
    float v, v_sq_slope;   /* events per tick at the start; change of its square per event */
    bool waited;           /* the newest span is a wait: the event after it comes alone */
    int64_t duration_q16;
    int64_t
        spent_q16; /* from the start of the segment to the end of the spans made; < 0: they end before it */
    uint32_t ticks_made; /* duration of all spans ever made, wraps */
    uint32_t segments;   /* ever taken */
    uint32_t clamped;    /* intervals stretched to min_interval_ticks */
};

void prep_init(struct prep *prep, struct segment_ring *in, struct step *step,
               const struct prep_timing *timing);

/** Cut segments into spans until PREP_AHEAD_US is reached or the segment ring is empty, and start the timer
 * if it rests.
 *  @return true when spans were made. Never blocks. */
bool prep_poll(struct prep *prep);

/** Forget the segment being cut and stand at this position. Only while the step ISR is not active. */
void prep_reset(struct prep *prep, const int32_t position[AXIS_COUNT]);

/** True when no segment is being cut and none waits. */
bool prep_is_empty(const struct prep *prep);

#endif
