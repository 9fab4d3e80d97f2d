/* SPDX-License-Identifier: MIT
 * Two arms in a plane, both motors at the hub (a pair of parallel bars turns the outer arm): each joint is
 * the angle of an arm against the X axis, degrees, counter-clockwise.
 *
 *     x = L1 cos(a1) + L2 cos(a2)       y = L1 sin(a1) + L2 sin(a2)
 *
 * With D the distance from the hub and T its direction, the law of cosines gives the angle at the hub and at
 * the elbow:
 *
 *     cos(T2) = (L1^2 + D^2 - L2^2) / (2 L1 D)       a1 = T + T2
 *     cos(T3) = (L1^2 + L2^2 - D^2) / (2 L1 L2)      a2 = a1 + T3 - 180
 *
 * The elbow stays on the left of the way from hub to tool. */
#include "motion/kinematics/kinematics.h"

#include "base/trig.h"

#include <math.h>
#include <string.h>

#define RAD_PER_DEG (TRIG_PI / 180.0)
#define CENTER_MM   1e-9 /* nearer to the hub a direction is only rounding */

static void forward(const struct kinematics *kinematics, const double joints[AXIS_COUNT],
                    double tool_mm[AXIS_COUNT]) {
    const double *arm_mm = kinematics->arm_mm;
    double sine[2], cosine[2];
    for (unsigned i = 0; i < 2; i++)
        trig_sincos(fmod(joints[i], 360.0) * RAD_PER_DEG, &sine[i], &cosine[i]);
    memcpy(tool_mm, joints, AXIS_COUNT * sizeof tool_mm[0]);
    tool_mm[AXIS_X] = arm_mm[0] * cosine[0] + arm_mm[1] * cosine[1];
    tool_mm[AXIS_Y] = arm_mm[0] * sine[0] + arm_mm[1] * sine[1];
}

/* Angle of the triangle between sides a and b, opposite to c; rounding may take its cosine beyond 1. */
static double corner_rad(double a, double b, double c) {
    double cosine = (a * a + b * b - c * c) / (2.0 * a * b);
    cosine = cosine > 1.0 ? 1.0 : cosine < -1.0 ? -1.0 : cosine;
    return trig_atan2(sqrt((1.0 - cosine) * (1.0 + cosine)), cosine);
}

static double turned_near(double angle, double near) {
    return angle + 360.0 * floor((near - angle) / 360.0 + 0.5);
}

static void inverse(const struct kinematics *kinematics, const double tool_mm[AXIS_COUNT],
                    const double near[AXIS_COUNT], double joints[AXIS_COUNT]) {
    const double *arm_mm = kinematics->arm_mm;
    double x = tool_mm[AXIS_X], y = tool_mm[AXIS_Y], distance_mm = sqrt(x * x + y * y);
    memcpy(joints, tool_mm, AXIS_COUNT * sizeof joints[0]);
    if (distance_mm <= CENTER_MM) { /* arms of one length, one on the other, in any direction */
        joints[0] = near[0];
        joints[1] = turned_near(near[0] - 180.0, near[1]);
        return;
    }
    double hub = corner_rad(arm_mm[0], distance_mm, arm_mm[1]);
    double elbow = corner_rad(arm_mm[0], arm_mm[1], distance_mm);
    double first = trig_atan2(y, x) + hub, second = first + elbow - TRIG_PI;
    joints[0] = turned_near(first / RAD_PER_DEG, near[0]);
    joints[1] = turned_near(second / RAD_PER_DEG, near[1]);
}

/* With both angles linear in s = 0 .. 1, |x''| <= L1 a1'^2 + L2 a2'^2; a curve lies within |x''|/8 of its
 * chord. */
static double bend_mm(const struct kinematics *kinematics, const double from[AXIS_COUNT],
                      const double to[AXIS_COUNT]) {
    double sum_mm = 0.0;
    for (unsigned i = 0; i < 2; i++) {
        double turn = (to[i] - from[i]) * RAD_PER_DEG;
        sum_mm += kinematics->arm_mm[i] * turn * turn;
    }
    return 0.125 * sum_mm;
}

/* Where both arms lie on one line, both turns move the tool the same way. */
static double stretch(const struct kinematics *kinematics, const double from[AXIS_COUNT],
                      const double to[AXIS_COUNT]) {
    const double *arm_mm = kinematics->arm_mm;
    double most = sqrt(arm_mm[0] * arm_mm[0] + arm_mm[1] * arm_mm[1]) * RAD_PER_DEG;
    (void)from;
    (void)to;
    return most > 1.0 ? most : 1.0;
}

static void reach_mm(const struct kinematics *kinematics, double *least_mm, double *most_mm) {
    const double *arm_mm = kinematics->arm_mm;
    *least_mm = fabs(arm_mm[0] - arm_mm[1]);
    *most_mm = arm_mm[0] + arm_mm[1];
}

const struct kinematics_ops kinematics_scara = {
    .forward = forward, .inverse = inverse, .bend_mm = bend_mm, .stretch = stretch, .reach_mm = reach_mm};
