/* SPDX-License-Identifier: MIT
 * From a place of the path to the steps of a segment, as it is or shaped. [task]
 *
 * Places are absolute, in 1/HISTORY_STEP step, and half a step more, so that rounding down is to the nearest
 * step. What is left of a step goes into the segment's phases. */
#ifndef WIFICNC_MOTION_AXES_H
#define WIFICNC_MOTION_AXES_H

#include "motion/history.h"
#include "segment/segment.h"

/** Where the axes are: at the end of the newest segment. Kept at marks (segment/ahead.h). */
struct axes {
    const struct shaper *shaper;  /* what is made of the path */
    int32_t steps[AXIS_COUNT];    /* to the nearest step below ... */
    float v_mm_s;                 /* along their path */
    float time_ns;                /* fraction of a nanosecond carried from segment to segment */
    uint8_t fraction[AXIS_COUNT]; /* ... plus this, in 1/256; 128 is exactly on a step */
};

/** The axes rest on these steps; what is carried of the time stays. */
void axes_rest(struct axes *axes, const int32_t steps[AXIS_COUNT]);

/** A place that is exactly on a step. */
static inline int64_t axes_exactly_on(int32_t steps) {
    return (int64_t)steps * HISTORY_STEP + HISTORY_STEP / 2;
}

/** Steps and phases from where the last segment ended to here. */
void axes_go(struct axes *axes, struct segment *segment, const int64_t at[CORE_AXES], unsigned axis_count);

/** The same to where the shaper has the axes; their speed and the segment's ramp, too.
 *  @param behind  history_moves(); else they have come to rest
 *  @return the mean speed of the steps, as a part of that of its ends: between them the shaped speed is a
 *  curve, and that of the steps a line */
float axes_follow(struct axes *axes, struct segment *segment, const struct history_shape *shape, bool behind,
                  const struct motion_limits *limits, float time_s);

/** A duration in whole nanoseconds, > 0. */
uint32_t axes_ns(struct axes *axes, float time_s);

/** segment.ramp. @param v0,v1  speed at its start and end, same unit, >= 0 */
int16_t axes_ramp(float v0, float v1);

#endif
