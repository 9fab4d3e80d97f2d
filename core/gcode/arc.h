/* SPDX-License-Identifier: MIT
 * An arc or helix as a stream of chord end points. [task] Resumable: the caller takes the next point when it
 * has room.
 *
 * Points come from the absolute angle; between two of these, ARC_RENEW_CHORDS apart, the direction is turned
 * by the exact chord angle, so that errors cannot add up: every point lies within 1e-9 mm of the exact arc up
 * to a radius of 100 m. The last point is the programmed target itself. A chord of angle w deviates from the
 * circle by r(1-cos(w/2)): that is kept at or below the tolerance.
 *
 * If CAM rounding put the centre not equally far from both ends, the radius changes evenly from one to the
 * other: by Grbl's rule, or as far as $41 allows (resolve_arc.c). Axes outside the plane, rotary ones too,
 * move evenly with the angle. */
#ifndef WIFICNC_GCODE_ARC_H
#define WIFICNC_GCODE_ARC_H

#include "base/axis.h"
#include "gcode/gcode.h"

#include <stdbool.h>
#include <stdint.h>

/** Chords between two points from the absolute angle; a power of two. */
#define ARC_RENEW_CHORDS 16u

/** First and second axis of each plane: counter-clockwise turns the first towards the second. */
extern const uint8_t arc_plane_axes[3][2];

struct arc {
    double center_mm[2];
    double start_mm[AXIS_COUNT];
    double target_mm[AXIS_COUNT];
    double radius_mm, radius_change_mm; /* at the start; to the radius at the target */
    double start_rad, travel_rad; /* travel > 0: counter-clockwise; |travel| in (0, 2 pi] plus whole turns */
    double direction[2];          /* unit vector, centre to the last point given */
    double chord_cos, chord_sin;  /* of the angle of one chord */
    double chord_part;            /* 1/chords */
    uint32_t chords, done;
    uint8_t ax0, ax1; /* plane axes */
    bool helical;     /* some other axis moves */
};

/** Start an arc at start_mm for a resolved move (MOTION_ARC_CW or _CCW). A target less than 1e-6 mm ahead of
 * the start along the circle means a full turn.
 *  @param tolerance_mm  greatest distance of a chord from the circle ($12); taken as 1e-6 if smaller */
void arc_begin(struct arc *arc, const double start_mm[AXIS_COUNT], const struct gcode_move *move,
               double tolerance_mm);

/** Path length in XYZ of the arc or helix, mm: what the feed is measured along. */
double arc_length_mm(const struct arc *arc);

/** Next chord end. @return false when all were given; the last one equals the programmed target. */
bool arc_next(struct arc *arc, double point_mm[AXIS_COUNT]);

#endif
