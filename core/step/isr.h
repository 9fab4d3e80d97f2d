/* SPDX-License-Identifier: MIT
 * The step ISR and its state. Only core/step/isr.c and targets' hal/hal_step.h run in interrupt context.
 *
 * Order of an event (least jitter first):
 *   1. the step bits computed one event ago go to the pins;
 *   2. while the pulse is high: count, next phases, next step bits, next alarm;
 *   3. the pulse ends, no earlier than step_pulse;
 *   4. if a new span began, its direction bits go out, dir_setup or more before its first step.
 *
 * A new span begins with the last event of the one before, and brings its laser's duty with it: one store. */
#ifndef WIFICNC_STEP_ISR_H
#define WIFICNC_STEP_ISR_H

#include "segment/segment.h"
#include "step/span.h"

#include <stdbool.h>

struct hal_step;

/** One event in step.at. */
#define STEP_AT_EVENT 0x10000u

enum step_beam {
    STEP_BEAM_NONE,   /* the PWM output is a spindle's, and no concern of the ISR */
    STEP_BEAM_DARK,   /* it is a laser's, which may not burn */
    STEP_BEAM_ALLOWED /* each span brings its duty */
};

struct step {
    /* touched at every event */
    uint32_t phase[SPAN_WORDS];
    uint32_t increment[SPAN_WORDS];
    uint32_t interval_q16;
    int32_t delta_q16;
    uint32_t at;       /* low half: index of the current span; high half: minus its events not yet put out.
                          One word, so that every reader on every core sees both of the same moment */
    struct span *span; /* the current span, or the last one while nothing moves; never NULL */
    struct hal_step *hal;
    uint16_t fraction_q16; /* of a tick, carried from interval to interval */
    axis_mask_t next;      /* step bits of the coming event */
    bool watch_probe;
    /* touched when a span ends */
    uint8_t beam;           /* enum step_beam */
    uint16_t dark;          /* what the PWM's register shows without a pulse */
    volatile bool active;   /* the timer runs; while false the ISR does not touch anything here */
    volatile bool halted;   /* step_halt() was called: step_start() waits for step_stand() */
    bool probe_hit;         /* a watched probe closed; cleared by the task that waits for it */
    uint32_t probe_done;    /* events of probe_span that were put out when it closed */
    struct span probe_span; /* the span in which it closed */
    uint32_t spans_done;    /* wraps */
    struct span pool[SPAN_POOL_SIZE];
};

/** What the step ISR is doing, of one moment. */
struct step_now {
    int32_t position[AXIS_COUNT]; /* steps that have left the pins */
    uint32_t left;                /* events of the current span that have not been put out */
    uint16_t flags;               /* of the current span: enum span_flags */
    uint32_t line;
    uint32_t v_um_s; /* along the path */
    uint16_t duty;   /* of a laser, as its PWM's register has it */
    uint32_t increment[SPAN_WORDS];
    axis_mask_t negative;
};

/** [motion] Not active, position zero: the first span of the pool says where the machine is. */
void step_init(struct step *step, struct hal_step *hal);

/** [isr] One event of the step timer. */
void step_isr(struct step *step);

/** [motion] Nothing moves and the last span was left: begin with this one. */
void step_start(struct step *step, struct span *span);

/** [task or isr] Stop immediately: no further pulse leaves the pins, until step_stand(). */
void step_halt(struct step *step);

/** [task] Whose the PWM output is, and whether a laser may burn. One that may not is dark when this returns;
 * from then on step_tend_beam() keeps it so. @param dark  what the PWM's register shows without a pulse */
void step_set_beam(struct step *step, enum step_beam rule, uint16_t dark);

/** [motion] What is not the ISR's: a laser at rest, and one that may not burn.
 * @param rest  an aiming beam, as the PWM's register has it */
void step_tend_beam(struct step *step, uint16_t rest);

/** [task] There are spans, and none of them has a step: the motors are at rest, and time passes. Only while
 * not active. */
bool step_only_waits(const struct step *step);

/** [motion] Nothing moves: this span, which has no events, says where the machine is from now on. */
void step_stand(struct step *step, struct span *span);

/** [task] Look for a contact from now on, or for the next one. */
static inline void step_watch_probe(struct step *step) {
    step->probe_hit = false;
}

/** [task] Where the probe closed, exact to the step. Only after probe_hit. */
void step_probe_position(const struct step *step, int32_t out[AXIS_COUNT]);

/** [task or isr] Steps that have left the pins, exact at every instant, also while the ISR runs or is
 * interrupted in the middle of its work. */
void step_position(const struct step *step, int32_t out[AXIS_COUNT]);

/** [task or isr] The same and what the current span says of itself. */
void step_look(const struct step *step, struct step_now *now);

/** [task or isr] All motion has been made to the end. Not so when step_halt() cut it off, until
 * step_stand(). */
static inline bool step_is_resting(const struct step *step) {
    if (__atomic_load_n(&step->active, __ATOMIC_ACQUIRE))
        return false;
    const struct span *span = step->span;
    return __atomic_load_n(&span->next, __ATOMIC_ACQUIRE) == span;
}

/** [motion] Index of the current span in the pool. */
static inline uint32_t step_index(const struct step *step) {
    return __atomic_load_n(&step->at, __ATOMIC_ACQUIRE) & 0xFFFFu;
}

#endif
