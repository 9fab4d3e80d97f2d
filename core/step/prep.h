/* SPDX-License-Identifier: MIT
 * Segments -> spans. [motion side: a task on the ISR's core, or the main loop]
 *
 * Within a segment the speed is linear in time, so v^2 is linear in distance, and the times of all events are
 * known in closed form. Events are the dominant axis' steps, or equal parts of them. A segment need not begin
 * and end on one: the time from its last event to the end goes into the first interval of the next
 * segment, so steps keep their pace across segments. A span makes its intervals linear in the event count.
 * Over a stretch whose speed changes by the ratio q that is wrong by less than ((q-1)/(q+1))^2 / 10 of the
 * stretch's time, so prep cuts the segment where q passes 9/8 (below 0.04 %), or near to rest, where a
 * stretch has few events, 5/4 and 3/2. The cut points themselves and the end are exact.
 *
 * A span of a cut has the duty of a laser that belongs to its mean speed, so each burns what its length asks
 * for; where the duty changes within a segment, spans are shorter.
 *
 * A batch (segment/queue.h) is cut whole, its stop included, into a chain of its own, and then joined to the
 * span at its mark by one compare-and-swap of that span's `next`:
 *
 *     a -> b -> c -> d -> e(rest)          the ISR is in a; the batch continues after b
 *          '--> f -> g -> h -> i(rest)     built here; swap b.next from c to f
 *
 * Either it succeeds: the ISR has not left b, will find f, and c d e are free. Or it fails, because the ISR
 * has taken c out before: the new chain is free, and the batch is refused. There is no third case, so the ISR
 * runs one of two chains that both end at rest, even when no task ever runs again. Of its own state (phases,
 * fractions of a tick, position) prep keeps a copy at each mark.
 *
 * Spans are this side's. The ISR reads those of the chain and writes only `next`. One that it has left is
 * free, but not before step.at says so. */
#ifndef WIFICNC_STEP_PREP_H
#define WIFICNC_STEP_PREP_H

#include "base/duty.h"
#include "segment/queue.h"
#include "step/isr.h"

/** What the board fixes, in ticks of its step timer. */
struct prep_timing {
    uint32_t timer_hz;
    uint32_t min_interval_ticks; /* pulse and the same low time: no two events closer */
    uint32_t dir_setup_ticks;    /* added where a direction line changes */
    struct duty_register pwm;    /* of a laser */
    struct duty_curve curve;     /* of it, too */
};

/** What is carried from one segment to the next. */
struct prep_carry {
    int32_t position[AXIS_COUNT]; /* steps at the end of all spans made so far */
    uint64_t tick_remainder;      /* of the last segment, in 1/1e9 tick */
    int64_t duration_q16;         /* of the segment being cut, ticks in Q16.16 */
    int64_t spent_q16;            /* from its start to the end of the spans made; < 0: they end before it */
    axis_mask_t last_negative;
    uint8_t shift; /* events of the last segment's steps were multiplied by 2^shift */
    bool alone;    /* the next event is in a span of its own: the interval before it is of another kind */
    bool late;     /* the laser's last change is nearest to the next event, and until then it has ... */
    uint16_t late_duty;
};

struct prep_mark {
    struct prep_carry carry;
    struct span *span; /* motion may branch off at the end of this one ... */
    uint32_t made;     /* ... while it is this one */
};

struct prep {
    struct segment_queue *in;
    struct step *step;
    struct prep_timing timing;
    struct prep_carry carry;
    /* the batch */
    struct span *base;           /* it continues after this span */
    struct span *first, *newest; /* of its chain; NULL: none yet */
    uint32_t cut;                /* segments of it */
    bool cuts;                   /* it is being cut, in portions ... */
    bool loaded;                 /* ... and has stopped within a segment */
    /* the segment being cut; distances in events */
    uint16_t flags;
    uint32_t line, end_us;
    uint32_t v_um_s;
    axis_mask_t negative;
    uint32_t phase[SPAN_WORDS], increment[SPAN_WORDS];
    uint32_t events, done;              /* of the segment */
    uint16_t duty[2];                   /* of a laser at its start and end */
    float dv_most;                      /* change of speed that a span may have, events per tick; 0: any */
    struct segment_power start;         /* the duty at its start, where that is late */
    const struct segment_power *listed; /* those within it */
    const struct segment_power *power;  /* the next change of its S ... */
    uint32_t power_left;                /* ... so many of them */
    uint32_t power_events;              /* ... when so many events are done */
    float way;                          /* of the segment */
    bool falls;                         /* its events go in negative direction */
    float first_event;                  /* from the start of the segment to its first event, 0 .. 1 */
    float v, v_sq_slope;                /* events per tick at the start; change of its square per event */
    /* spans */
    struct span *free;   /* linked by `after` */
    struct span *oldest; /* of the chain: the ISR's or one that it has left */
    uint32_t made;       /* spans ever */
    struct prep_mark marks[QUEUE_MARKS];
    uint32_t segments;  /* ever stepped */
    uint32_t clamped;   /* intervals stretched to min_interval_ticks */
    uint16_t rest_duty; /* of a laser at rest */
};

/** After step_init(). */
void prep_init(struct prep *prep, struct segment_queue *in, struct step *step,
               const struct prep_timing *timing);

/** What a laser shows at rest: an aiming beam, or nothing. [task] @param duty  0 .. DUTY_FULL */
static inline void prep_set_rest_duty(struct prep *prep, uint16_t duty) {
    __atomic_store_n(&prep->rest_duty, duty, __ATOMIC_RELAXED);
}

/** What the step ISR does not put out: a laser at rest, and one that may not burn. Before each prep_poll(),
 * and while motion waits for its motors. */
void prep_tend_beam(const struct prep *prep);

/** Free the spans that the step ISR has left; cut a portion of the batch that waits, and join it to the chain
 * when it is whole; start the timer if it rests.
 *  @return true when something was done: call again. Never blocks. */
bool prep_poll(struct prep *prep);

/** Forget all motion and stand at this position. Only while the step ISR is not active. */
void prep_reset(struct prep *prep, const int32_t position[AXIS_COUNT]);

#endif
