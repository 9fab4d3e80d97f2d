/* SPDX-License-Identifier: MIT
 * Where the spindle is and how fast it turns, from the edges of its encoder. [task] Pure.
 *
 * An edge says the angle exactly, at the time it came. A fading-memory filter of second order (position and
 * speed, both poles at z = tau / (tau + dt)) follows them, so neither the width of a count nor the grain of
 * the clock is seen in the speed, and edges may come a thousand a millisecond or one a revolution. Angles at
 * other times are extrapolated. A spindle whose next edge is overdue turns no faster than that edge allows,
 * so one that stops is known to be still.
 *
 * Angles are revolutions, positive clockwise (M3). */
#ifndef WIFICNC_MOTION_SPINDLE_H
#define WIFICNC_MOTION_SPINDLE_H

#include <stdbool.h>
#include <stdint.h>

struct spindle {
    float per_rev;    /* counts per revolution; 0: there is no encoder */
    int64_t total;    /* counts since the reset */
    int32_t counts;   /* as the encoder says them */
    uint32_t edge_us; /* of the newest edge */
    float ahead;      /* filtered position at that time, counts beyond `total` */
    float rate;       /* filtered speed, counts/s */
    uint8_t edges;    /* seen since the reset or a long rest: 0, 1 or 2 = enough for a speed */
    float mark_rate;  /* the speed has been near this ... */
    uint32_t mark_us; /* ... since then */
    int64_t zero;     /* `total` where angles count from */
};

/** Forget everything. @param per_rev  counts of one revolution, > 0; 0: there is no encoder */
void spindle_reset(struct spindle *spindle, float per_rev);

/** What the encoder says now: struct hal_encoder_state. Often enough that fewer than 2^31 counts lie between
 * two calls. */
void spindle_take(struct spindle *spindle, int32_t counts, uint32_t edge_us, uint32_t now_us);

/** Angles count from here from now on: where the encoder said `counts`, less than 2^31 counts ago. */
void spindle_set_zero(struct spindle *spindle, int32_t counts);

/** Speed, revolutions/s; 0: it is still, or this is not known. */
float spindle_rev_s(const struct spindle *spindle, uint32_t now_us);

/** Angle at a time near now, revolutions from zero. */
double spindle_revs(const struct spindle *spindle, uint32_t at_us, uint32_t now_us);

/** Angle now, revolutions from the first index pulse after the reset on, or before it: whole at every index
 * pulse.
 * @param index_counts  what the encoder said at the newest one, less than 2^31 counts ago */
double spindle_turns(const struct spindle *spindle, int32_t index_counts, uint32_t now_us);

/** It has turned at one speed, within SPINDLE_STEADY_PART, for SPINDLE_STEADY_US. */
bool spindle_is_steady(const struct spindle *spindle, uint32_t now_us);

/** It was commanded to turn otherwise: it is not steady now, though it may look so. */
void spindle_disturb(struct spindle *spindle, uint32_t now_us);

#define SPINDLE_STEADY_PART 0.02f
#define SPINDLE_STEADY_US   200000u

#endif
