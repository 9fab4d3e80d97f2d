/* SPDX-License-Identifier: MIT
 * The step ISR and its state. Only core/step/isr.c and targets' hal/hal_step.h run in interrupt context.
 *
 * Order of an event (least jitter first):
 *   1. the step bits computed one event ago go to the pins;
 *   2. while the pulse is high: count, next phases, next step bits, next alarm;
 *   3. the pulse ends, no earlier than step_pulse;
 *   4. if a new span began, its direction bits go out, dir_setup or more before its first step. */
#ifndef WIFICNC_STEP_ISR_H
#define WIFICNC_STEP_ISR_H

#include "segment/segment.h"
#include "step/span.h"

#include <stdbool.h>

struct hal_step;

struct step {
    /* touched at every event */
    uint32_t phase[SPAN_WORDS];
    uint32_t increment[SPAN_WORDS];
    uint32_t interval_q16;
    int32_t delta_q16;
    uint32_t events_left;    /* of the current span, that have not been put out */
    const struct span *span; /* the current one, at the ring's tail; while loaded */
    struct hal_step *hal;
    uint16_t fraction_q16; /* of a tick, carried from interval to interval */
    axis_mask_t next;      /* step bits of the coming event */
    bool watch_probe;
    /* touched when a span ends */
    volatile bool active;   /* the timer runs; while false the ISR does not touch anything here */
    volatile bool halted;   /* step_halt() was called: step_start() waits for step_flush() */
    bool loaded;            /* the span at the ring's tail is the current one */
    bool probe_hit;         /* a watched probe closed; cleared by the task that waits for it */
    uint32_t probe_left;    /* events_left of probe_span when it closed */
    struct span probe_span; /* the span in which it closed */
    uint32_t underruns;     /* the span ring ran dry in motion */
    uint32_t spans_done;
    uint32_t ticks_done; /* duration of all spans done, wraps */
    struct span_ring ring;
};

/** [task] Not active, position zero. */
void step_init(struct step *step, struct hal_step *hal);

/** [isr] One event of the step timer. */
void step_isr(struct step *step);

/** [task] Begin with the span at the ring's tail if the timer stands still and there is one. The caller runs
 * on the core of the ISR, or nothing else can start the timer. */
void step_start(struct step *step);

/** [task or isr] Stop at once: no further pulse leaves the pins, until step_flush(). Spans stay in the ring
 * for step_position(). */
void step_halt(struct step *step);

/** [task] There are spans, and none of them has a step: the motors stand, and time passes. Only while not
 * active. */
bool step_only_waits(const struct step *step);

/** [task] Forget all spans. Only while not active; take step_position() before. */
void step_flush(struct step *step);

/** [task] Where the probe closed, exact to the step. Only after probe_hit. */
void step_probe_position(const struct step *step, int32_t out[AXIS_COUNT]);

/** [task] Steps that have left the pins, exact at every instant, also while the ISR runs.
 *  @param rest  position to report when no span is loaded (prep's end position) */
void step_position(const struct step *step, const int32_t rest[AXIS_COUNT], int32_t out[AXIS_COUNT]);

#endif
