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
#define FILTER_MAX 16u

/** 1 step in the filter's units. */
#define FILTER_STEP 65536

/** What is averaged: the axes, and the place on the path that S of a laser belongs to (motion/power.h). */
enum { FILTER_PLACE = AXIS_COUNT, FILTER_LANES };

/** The newest samples: all that the mean depends on. */
struct filter_past {
    int64_t in[FILTER_LANES]; /* newest position, 1/65536 step */
    int32_t moves[FILTER_MAX][FILTER_LANES];
    /** The piece of path that each is of, in path.pieces: what belongs to a sample in addition to its motion
     * belongs where the sample has most weight, T/2 later. */
    uint16_t pieces[FILTER_MAX];
    uint8_t at;     /* where the newest sample is in the rings */
    uint8_t moving; /* samples until the mean is still, if the axes stay where they are */
};

struct filter {
    uint8_t count;             /* samples in the mean; 0: the filter is off */
    float sample_s;            /* time from sample to sample */
    int64_t sum[FILTER_LANES]; /* of the last `count` moves */
    int64_t out[FILTER_LANES]; /* `count` times the mean position */
    struct filter_past past;
};

/** Average over this time from now on; 0: off. filter_reset() follows. */
void filter_set(struct filter *filter, float time_s);

/** Stand still here. */
void filter_reset(struct filter *filter, const int64_t in[FILTER_LANES]);

/** The next sample. */
void filter_push(struct filter *filter, const int64_t in[FILTER_LANES], uint16_t piece);

/** The mean position, 1/65536 step. */
static inline int64_t filter_out(const struct filter *filter, unsigned lane) {
    return filter->out[lane] / filter->count;
}

/** The piece of a sample. @param before_newest  below count */
static inline uint16_t filter_piece(const struct filter *filter, const struct filter_past *past,
                                    uint32_t before_newest) {
    return past->pieces[(past->at + filter->count - before_newest) % filter->count];
}

/** The piece of the sample in the middle of the mean. */
static inline uint16_t filter_middle_piece(const struct filter *filter) {
    return filter_piece(filter, &filter->past, filter->count - filter->count / 2u);
}

/** The piece of the oldest sample. */
static inline uint16_t filter_oldest_piece(const struct filter *filter, const struct filter_past *past) {
    return filter_piece(filter, past, filter->count - 1u);
}

/** Continue with these samples, kept when the filter was the same. */
void filter_load(struct filter *filter, const struct filter_past *past);

#endif
