/* SPDX-License-Identifier: MIT
 * An arc or helix as a stream of chord end points. [task] Resumable: the caller takes the next point when it has room.
 *
 * Points come from the absolute angle, never from repeated rotation, so that errors do not add up; the last point is
 * the programmed target itself. A chord of angle w deviates r(1 - cos(w/2)) from the circle: that is kept at or below
 * the tolerance. */
#ifndef WIFICNC_GCODE_ARC_H
#define WIFICNC_GCODE_ARC_H

#include "base/axis.h"
#include "gcode/gcode.h"

struct arc {
    double center_mm[2];
    double start_mm[AXIS_COUNT];
    double target_mm[AXIS_COUNT];
    double radius_mm, radius_change_mm; /* at the start; to the radius at the target (CAM rounding) */
    double start_rad, travel_rad;       /* travel: > 0 counter-clockwise, |travel| in (0, 2 pi] */
    uint32_t chords, done;
    uint8_t ax0, ax1;                   /* plane axes */
};

/** Start an arc at start_mm for a resolved move (MOTION_ARC_CW or _CCW).
 *  @param tolerance_mm  > 0, greatest distance of a chord from the circle ($12) */
void arc_begin(struct arc *arc, const double start_mm[AXIS_COUNT], const struct gcode_move *move, double tolerance_mm);

/** Path length of the arc or helix, mm: what the feed is measured along. */
double arc_length_mm(const struct arc *arc);

/** Next chord end. @return false when all were given; the last one equals the programmed target. */
bool arc_next(struct arc *arc, double point_mm[AXIS_COUNT]);

#endif
