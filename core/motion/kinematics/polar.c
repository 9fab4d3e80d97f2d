/* SPDX-License-Identifier: MIT
 * Polar: the X motor moves the tool along a radius, the Y motor turns the table (or the arm).
 *
 *     R = sqrt(x^2 + y^2) mm        x = R cos(phi)
 *     phi = atan2(y, x) degrees     y = R sin(phi)
 *
 * The angle goes the shortest way round, through 0 too, so it may count beyond a turn. At the centre every
 * angle is right, and the table stays as it is. */
#include "motion/kinematics/kinematics.h"

#include "base/trig.h"

#include <math.h>
#include <string.h>

#define RAD_PER_DEG (TRIG_PI / 180.0)
#define CENTER_MM   1e-9 /* nearer to it an angle is only rounding */

enum { RADIUS, ANGLE };

static void forward(const struct kinematics *kinematics, const double joints[AXIS_COUNT],
                    double tool_mm[AXIS_COUNT]) {
    double sine, cosine, radius_mm = joints[RADIUS];
    (void)kinematics;
    trig_sincos(fmod(joints[ANGLE], 360.0) * RAD_PER_DEG, &sine, &cosine);
    memcpy(tool_mm, joints, AXIS_COUNT * sizeof tool_mm[0]);
    tool_mm[AXIS_X] = radius_mm * cosine;
    tool_mm[AXIS_Y] = radius_mm * sine;
}

static void inverse(const struct kinematics *kinematics, const double tool_mm[AXIS_COUNT],
                    const double near[AXIS_COUNT], double joints[AXIS_COUNT]) {
    double x = tool_mm[AXIS_X], y = tool_mm[AXIS_Y], radius_mm = sqrt(x * x + y * y);
    (void)kinematics;
    memcpy(joints, tool_mm, AXIS_COUNT * sizeof joints[0]);
    joints[RADIUS] = radius_mm;
    joints[ANGLE] = near[ANGLE];
    if (radius_mm > CENTER_MM) {
        double angle = trig_atan2(y, x) / RAD_PER_DEG;
        joints[ANGLE] = angle + 360.0 * floor((near[ANGLE] - angle) / 360.0 + 0.5);
    }
}

/* With R and phi linear in s = 0 .. 1 the acceleration of the tool is
 *
 *     -R phi'^2 along the radius, 2 R' phi' across it
 *
 * and a curve with |x''| <= m lies within m/8 of its chord. */
static double bend_mm(const struct kinematics *kinematics, const double from[AXIS_COUNT],
                      const double to[AXIS_COUNT]) {
    double turn = (to[ANGLE] - from[ANGLE]) * RAD_PER_DEG, way_mm = to[RADIUS] - from[RADIUS];
    double most_mm = to[RADIUS] > from[RADIUS] ? to[RADIUS] : from[RADIUS];
    (void)kinematics;
    return 0.125 * (most_mm * turn * turn + 2.0 * fabs(way_mm * turn));
}

static double stretch(const struct kinematics *kinematics, const double from[AXIS_COUNT],
                      const double to[AXIS_COUNT]) {
    double most_mm = to[RADIUS] > from[RADIUS] ? to[RADIUS] : from[RADIUS];
    double across_mm = most_mm * RAD_PER_DEG;
    (void)kinematics;
    return across_mm > 1.0 ? across_mm : 1.0;
}

static void reach_mm(const struct kinematics *kinematics, double *least_mm, double *most_mm) {
    *least_mm = 0.0;
    *most_mm = kinematics->travel_mm[RADIUS] > 0.0 ? kinematics->travel_mm[RADIUS] : HUGE_VAL;
}

const struct kinematics_ops kinematics_polar = {
    .forward = forward, .inverse = inverse, .bend_mm = bend_mm, .stretch = stretch, .reach_mm = reach_mm};
