/* SPDX-License-Identifier: MIT */
#include "gcode/arc.h"

#include "base/trig.h"

#include <math.h>   // sqrt fabs ceil: exact
#include <string.h> // memcpy

#define TOLERANCE_MIN_MM 1e-6
#define FULL_TURN_MM     1e-6 /* far below a step, far above the rounding of a computed position */

_Static_assert((ARC_RENEW_CHORDS & (ARC_RENEW_CHORDS - 1)) == 0, "arc_next() masks");

const uint8_t arc_plane_axes[3][2] = {
    [PLANE_XY] = {AXIS_X, AXIS_Y},
    [PLANE_ZX] = {AXIS_Z, AXIS_X},
    [PLANE_YZ] = {AXIS_Y, AXIS_Z},
};

static double length(double x, double y) {
    return sqrt(x * x + y * y);
}

/* Angle from (x0, y0) to (x1, y1) the asked way round: atan2 of their cross and dot product. */
static double find_travel_rad(double x0, double y0, double x1, double y1, const struct gcode_move *move) {
    double travel = trig_atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1);

    /* The same point as the start: a full turn, whatever the rounding of its coordinates. */
    if (fabs(travel) * length(x0, y0) < FULL_TURN_MM)
        travel = 0.0;
    if (move->motion == MOTION_ARC_CW)
        return (travel < 0.0 ? travel : travel - 2.0 * TRIG_PI) - 2.0 * TRIG_PI * move->turns;
    return (travel > 0.0 ? travel : travel + 2.0 * TRIG_PI) + 2.0 * TRIG_PI * move->turns;
}

/* Chords of angle w = 2c/r, where c = sqrt(t(2r - t)) is half the chord whose height is the tolerance t:
 * since asin x >= x, their height r(1 - cos(w/2)) is at most t. t <= r keeps w at 2 rad or less. Where the
 * radius changes by d within a chord, the middle of the path lies d^2/4r farther out, d w/4 across the chord
 * at most; both heights fall with the square of the number of chords. */
static uint32_t count_chords(double travel_rad, double radius_mm, double change_mm, double tolerance_mm) {
    double half_chord, circle;

    if (tolerance_mm < TOLERANCE_MIN_MM)
        tolerance_mm = TOLERANCE_MIN_MM;
    if (tolerance_mm > radius_mm)
        tolerance_mm = radius_mm;
    half_chord = sqrt(tolerance_mm * (2.0 * radius_mm - tolerance_mm));
    if (half_chord <= 0.0)
        return 1u;
    circle = fabs(travel_rad) * radius_mm / (2.0 * half_chord);
    return (uint32_t)ceil(sqrt(circle * circle + fabs(change_mm * travel_rad) / (4.0 * tolerance_mm)));
}

void arc_begin(struct arc *arc, const double start_mm[AXIS_COUNT], const struct gcode_move *move,
               double tolerance_mm) {
    const uint8_t ax0 = arc_plane_axes[move->plane][0], ax1 = arc_plane_axes[move->plane][1];
    const double x0 = start_mm[ax0] - move->center_mm[0], y0 = start_mm[ax1] - move->center_mm[1];
    const double x1 = move->target_mm[ax0] - move->center_mm[0],
                 y1 = move->target_mm[ax1] - move->center_mm[1];
    const double radius = length(x0, y0), target_radius = length(x1, y1);

    memcpy(arc->start_mm, start_mm, sizeof arc->start_mm);
    memcpy(arc->target_mm, move->target_mm, sizeof arc->target_mm);
    arc->center_mm[0] = move->center_mm[0];
    arc->center_mm[1] = move->center_mm[1];
    arc->ax0 = ax0;
    arc->ax1 = ax1;
    arc->helical = false;
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++) {
        if (axis != ax0 && axis != ax1 && arc->target_mm[axis] != arc->start_mm[axis])
            arc->helical = true;
    }
    arc->radius_mm = radius;
    arc->radius_change_mm = target_radius - radius;
    arc->start_rad = trig_atan2(y0, x0);
    arc->travel_rad = find_travel_rad(x0, y0, x1, y1, move);
    arc->chords = count_chords(arc->travel_rad, radius > target_radius ? radius : target_radius,
                               target_radius - radius, tolerance_mm);
    arc->chord_part = 1.0 / arc->chords;
    arc->done = 0;
    trig_sincos(arc->start_rad, &arc->direction[1], &arc->direction[0]);
    trig_sincos(arc->travel_rad * arc->chord_part, &arc->chord_sin, &arc->chord_cos);
}

double arc_length_mm(const struct arc *arc) {
    const double in_plane = (arc->radius_mm + 0.5 * arc->radius_change_mm) * arc->travel_rad;
    double squares = in_plane * in_plane + arc->radius_change_mm * arc->radius_change_mm;

    for (unsigned axis = 0; axis < AXIS_A; axis++) {
        const double change = arc->target_mm[axis] - arc->start_mm[axis];

        if (axis != arc->ax0 && axis != arc->ax1)
            squares += change * change;
    }
    return sqrt(squares);
}

/* The next direction: the last one turned by a chord, or again from the angle. */
static void turn_direction(struct arc *arc, double part) {
    const double c = arc->direction[0], s = arc->direction[1];

    if ((arc->done & (ARC_RENEW_CHORDS - 1)) == 0) {
        trig_sincos(arc->start_rad + arc->travel_rad * part, &arc->direction[1], &arc->direction[0]);
        return;
    }
    arc->direction[0] = c * arc->chord_cos - s * arc->chord_sin;
    arc->direction[1] = s * arc->chord_cos + c * arc->chord_sin;
}

bool arc_next(struct arc *arc, double point_mm[AXIS_COUNT]) {
    double part, radius;

    if (arc->done >= arc->chords)
        return false;
    arc->done++;
    /* The programmed point itself, so that the next line begins exactly there. */
    if (arc->done == arc->chords) {
        memcpy(point_mm, arc->target_mm, sizeof arc->target_mm);
        return true;
    }
    part = arc->done * arc->chord_part;
    radius = arc->radius_mm + arc->radius_change_mm * part;
    turn_direction(arc, part);
    memcpy(point_mm, arc->start_mm, sizeof arc->start_mm);
    for (unsigned axis = 0; arc->helical && axis < AXIS_COUNT; axis++)
        point_mm[axis] += (arc->target_mm[axis] - point_mm[axis]) * part;
    point_mm[arc->ax0] = arc->center_mm[0] + radius * arc->direction[0];
    point_mm[arc->ax1] = arc->center_mm[1] + radius * arc->direction[1];
    return true;
}
