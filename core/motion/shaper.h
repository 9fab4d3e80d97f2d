/* SPDX-License-Identifier: MIT
 * Input shaping and limited jerk: the axes follow a mean of where the path was. [task] Pure.
 *
 *     axis(t) = sum of weight[i] * mean of path over (t - delay[i] - mean_s ... t - delay[i])
 *
 * Weights are positive and their sum is 1, so speed and acceleration of every axis stay within its limits
 * whatever the path does, and the motion ends exactly where the path does. What is chosen freely:
 *
 *  - delays and weights for each axis, so that what its frame would still swing after each of the parts
 *    cancels: ZV, MZV, EI, two-hump EI (Singer and Seering 1990; Singhose 1994);
 *  - mean_s = 2 A / J for all: the acceleration of a mean changes by at most 2 A in that time.
 *
 * An axis with a shorter delay than another one waits for it: at constant speed no axis is ahead of the
 * others. What remains is half of the second moment of the weights times the acceleration, which is taken
 * from the tolerance: docs/motion.md. */
#ifndef WIFICNC_MOTION_SHAPER_H
#define WIFICNC_MOTION_SHAPER_H

#include "motion/move.h"

#include <stdbool.h>
#include <stdint.h>

#define SHAPER_TAPS 4u

/** What is shaped: the axes, and the place on the path that S of a laser belongs to (motion/power.h). */
enum { SHAPER_PLACE = AXIS_COUNT, SHAPER_LANES };

/** Of the lanes of its mask. */
struct shaper_row {
    uint8_t count;
    uint8_t lanes;
    float delay_s[SHAPER_TAPS]; /* ascending */
    float weight[SHAPER_TAPS];  /* > 0, sum 1 */
    float spread_s2;            /* second moment about their mean, mean_s not counted */
};

struct shaper {
    float mean_s;   /* limited jerk; 0: not limited */
    float late_s;   /* the mean delay of every lane, mean_s counted */
    float window_s; /* the axes rest so long after the path; 0: they follow it at once */
    uint32_t window_ns;
    float sample_s; /* time from sample to sample */
    bool sums;      /* rows are for the sum and the difference of the first two axes (CoreXY) */
    uint8_t row_count;
    struct shaper_row rows[AXIS_COUNT];
};

/** What these modes of the axes make.
 *  @param samples  that window_s may be long */
void shaper_set(struct shaper *shaper, const struct motion_limits *limits, float mean_s, uint32_t samples);

/** Second moment of an axis' weights, mean_s counted. */
float shaper_spread_s2(const struct shaper *shaper, unsigned axis);

/** Longest time from the mean delay to an end of the window. */
float shaper_reach_s(const struct shaper *shaper);

static inline bool shaper_is_on(const struct shaper *shaper) {
    return shaper->window_ns > 0;
}

#endif
