/* SPDX-License-Identifier: MIT
 * Input shaping and limited jerk: the axes follow a mean of where the path was. [task] Pure.
 *
 *     axis(t) = sum of weight[i] * mean of path over (t - delay[i] - mean ... t - delay[i])
 *
 * Weights are positive and their sum is 1, so speed and acceleration of every axis stay within its limits
 * whatever the path does, and the motion ends exactly where the path does. What is chosen freely:
 *
 *  - delays and weights for each axis, so that what its frame would still swing after each of the parts
 *    cancels: ZV, MZV, EI, two-hump EI (Singer and Seering 1990; Singhose 1994);
 *  - a mean for all, over 2 A / J where accelerations of up to A follow each other as they like: that of a
 * mean changes by at most 2 A in that time. Where there is more, it comes and goes in steps (motion/ramp.h).
 *
 * An axis with a shorter delay than another one waits for it: at constant speed no axis is ahead of the
 * others. What remains is half of the second moment of the weights times the acceleration, which is taken
 * from the tolerance: docs/motion.md. */
#ifndef WIFICNC_MOTION_SHAPER_H
#define WIFICNC_MOTION_SHAPER_H

#include "hal/core_sizes.h"
#include "motion/move.h"

#include <stdbool.h>
#include <stdint.h>

#define SHAPER_TAPS 4u

/** What is shaped: the axes, and the place on the path that S of a laser belongs to (motion/power.h). */
enum { SHAPER_PLACE = CORE_AXES, SHAPER_LANES };

/** Of the lanes of its mask. */
struct shaper_row {
    uint8_t count;
    uint8_t lanes;
    uint32_t delay_ns[SHAPER_TAPS]; /* ascending */
    float weight[SHAPER_TAPS];      /* > 0, sum 1 */
    float spread_s2;                /* second moment about their mean, mean_ns not counted */
};

struct shaper {
    uint32_t mean_ns;   /* limited jerk; 0: not limited */
    uint32_t late_ns;   /* the mean delay of every lane, mean_ns counted */
    uint32_t window_ns; /* the axes come to rest this much later than the path; 0: they are the path */
    float sample_s;     /* time from sample to sample */
    bool sums;          /* rows are for the sum and the difference of the first two axes (CoreXY) */
    uint8_t row_count;
    struct shaper_row rows[CORE_AXES];
};

/** What these modes of the axes make.
 *  @param mean_s  for limited jerk @param samples  that the window may have */
void shaper_set(struct shaper *shaper, const struct motion_limits *limits, float mean_s, uint32_t samples);

/** Second moment of an axis' weights, mean_ns counted. */
float shaper_spread_s2(const struct shaper *shaper, unsigned axis);

/** Longest time from the mean delay to an end of the window. */
float shaper_reach_s(const struct shaper *shaper);

static inline bool shaper_is_on(const struct shaper *shaper) {
    return shaper->window_ns > 0;
}

#endif
