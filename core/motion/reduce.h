/* SPDX-License-Identifier: MIT
 * Programmed points -> chords: points that a longer chord replaces within a tolerance are dropped. [task]
 *
 * From the anchor, the end of the last chord, a point at distance r with tolerance e allows all directions
 * within e/r of its own. What every point so far allows is kept as one ball of directions (middle, radius)
 * inside the intersection of all of them, so a decision costs the same after ten thousand points as after
 * two. In a plane the ball is the exact intersection of the cones (Williams 1978; Sklansky, Gonzalez 1980);
 * in space it is smaller, which is safe.
 *
 * A chord whose direction is in the ball passes every point within e; distances from the anchor that only
 * grow keep the points in its span, so the chord has no point farther than e from the programmed path either.
 */
#ifndef WIFICNC_MOTION_REDUCE_H
#define WIFICNC_MOTION_REDUCE_H

#include "motion/vec.h"

/** Points left out of a chord that are kept, so that it says how near to all of them it passes. */
#define REDUCE_KEPT 2u

struct reduce {
    double anchor_mm[AXIS_COUNT]; /* sum of all chords so far, so that rounding a chord never adds up */
    vec chord;                    /* anchor -> newest accepted point */
    vec middle;                   /* of the directions allowed */
    float radius;                 /* of the ball of directions */
    float reach_mm;               /* greatest distance from the anchor */
    bool open;                    /* a chord has begun */
    bool aimed;                   /* middle and radius are set */
    vec kept[REDUCE_KEPT];        /* anchor -> points of this chord that were dropped */
    uint32_t dropped;             /* so many points were */
};

/** Start at this position. */
void reduce_reset(struct reduce *reduce, const double position_mm[AXIS_COUNT]);

/** Take a point into the chord if the chord may end there.
 *  @param longest_mm  of a chord of several points; one of a single point has any length
 *  @return false: it may not; nothing was changed, reduce_close() and ask again */
bool reduce_accepts(struct reduce *reduce, const double point_mm[AXIS_COUNT], float tolerance_mm,
                    float longest_mm);

/** How far the points that were dropped lie from the chord at most; with more of them than are kept:
 * tolerance_mm, which all of them were accepted with. 0: none was. @param length_mm  of the chord, > 0 */
float reduce_away_mm(const struct reduce *reduce, float length_mm, float tolerance_mm);

/** End the chord at the newest accepted point, which becomes the anchor. */
void reduce_close(struct reduce *reduce);

#endif
