/* SPDX-License-Identifier: MIT
 * A cubic Bezier curve in XY as a stream of chord end points (G5; G5.1 is written as the cubic that it is).
 * [task] Resumable, as arc.h.
 *
 * Chords are equal steps of the parameter. A chord of 1/n leaves the curve by at most max|B''| / (8 n^2), and
 * |B''| is at most 6 times the larger second difference of the control points; n is chosen so that this is
 * the tolerance. */
#ifndef WIFICNC_GCODE_SPLINE_H
#define WIFICNC_GCODE_SPLINE_H

#include "base/axis.h"
#include "gcode/gcode.h"

#include <stdbool.h>
#include <stdint.h>

struct spline {
    double point_mm[4][2]; /* start, two control points, end */
    double target_mm[AXIS_COUNT];
    uint32_t chords, done;
};

/** Start at start_mm for a resolved move (MOTION_CUBIC or _QUADRATIC).
 *  @param tolerance_mm  greatest distance of a chord from the curve ($12); taken as 1e-6 if smaller */
void spline_begin(struct spline *spline, const double start_mm[AXIS_COUNT], const struct gcode_move *move,
                  double tolerance_mm);

/** Next chord end. @return false when all were given; the last one equals the programmed target. */
bool spline_next(struct spline *spline, double point_mm[AXIS_COUNT]);

#endif
