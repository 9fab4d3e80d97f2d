/* SPDX-License-Identifier: MIT
 * Limited jerk: the mean of where the axes were in the last T seconds. [task]
 *
 * What is averaged keeps every axis within its speed and its acceleration A, and so does the mean of it, for
 * both are means as well. The mean's acceleration is (v(t) - v(t-T)) / T, so its jerk is (a(t) - a(t-T)) / T,
 * at most 2 A / T: T = 2 A / J. That holds whatever happens: in curves, in holds and overrides, from piece to
 * piece. The price is T seconds at every stop, and a path that lies up to A T^2 / 24 inside of its curves,
 * which plan_set_limits() takes from the tolerance (docs/motion.md).
 *
 * Everything is counted in whole 1/65536 steps, so the mean ends exactly where the motion ends. */
#ifndef WIFICNC_MOTION_FILTER_H
#define WIFICNC_MOTION_FILTER_H

#include "base/axis.h"

#include <stdbool.h>
#include <stdint.h>

/** Most samples in the mean. */
#define FILTER_MOST 16u

/** 1 step in the filter's units. */
#define FILTER_STEP 65536

/** What is said of a sample besides its motion: it belongs where the sample has most weight, T/2 later. */
struct filter_tag {
    uint32_t line;
    uint8_t flags; /* enum motion_flags */
};

struct filter {
    uint8_t count;           /* samples in the mean; 0: the filter is off */
    uint8_t at;              /* where the newest sample is in the rings */
    uint8_t moving;          /* samples until the mean stands still, if the axes stay where they are */
    float sample_s;          /* time from sample to sample */
    int64_t in[AXIS_COUNT];  /* newest position, 1/65536 step */
    int64_t sum[AXIS_COUNT]; /* of the last `count` moves */
    int64_t out[AXIS_COUNT]; /* `count` times the mean position */
    int32_t moves[FILTER_MOST][AXIS_COUNT];
    struct filter_tag tags[FILTER_MOST];
};

/** Average over this time from now on; 0: off. filter_reset() follows. */
void filter_set(struct filter *filter, float time_s);

/** Stand still here. */
void filter_reset(struct filter *filter, const int64_t in[AXIS_COUNT]);

/** The next sample. */
void filter_push(struct filter *filter, const int64_t in[AXIS_COUNT], struct filter_tag tag);

/** The mean position, 1/65536 step. */
static inline int64_t filter_out(const struct filter *filter, unsigned axis) {
    return filter->out[axis] / filter->count;
}

/** The tag of the sample in the middle. */
static inline struct filter_tag filter_tag(const struct filter *filter) {
    return filter->tags[(filter->at + filter->count / 2u) % filter->count];
}

#endif
