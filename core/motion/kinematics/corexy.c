/* SPDX-License-Identifier: MIT
 * CoreXY: two fixed motors move X and Y together by one belt each.
 *
 *     A = X + Y        X = (A + B) / 2
 *     B = X - Y        Y = (A - B) / 2
 *
 * A way of d in X and Y is one of sqrt(2) d in A and B, whatever its direction; so what lies within the
 * tolerance in joints lies within 1/sqrt(2) of it in X and Y, and all of it in Z. */
#include "motion/kinematics/kinematics.h"

#include <string.h>

static void forward(const struct kinematics *kinematics, const double joints[AXIS_COUNT],
                    double tool_mm[AXIS_COUNT]) {
    (void)kinematics;
    memcpy(tool_mm, joints, AXIS_COUNT * sizeof tool_mm[0]);
    tool_mm[AXIS_X] = 0.5 * (joints[0] + joints[1]);
    tool_mm[AXIS_Y] = 0.5 * (joints[0] - joints[1]);
}

static void inverse(const struct kinematics *kinematics, const double tool_mm[AXIS_COUNT],
                    const double near[AXIS_COUNT], double joints[AXIS_COUNT]) {
    (void)kinematics;
    (void)near;
    memcpy(joints, tool_mm, AXIS_COUNT * sizeof joints[0]);
    joints[0] = tool_mm[AXIS_X] + tool_mm[AXIS_Y];
    joints[1] = tool_mm[AXIS_X] - tool_mm[AXIS_Y];
}

static double stretch(const struct kinematics *kinematics, const double from[AXIS_COUNT],
                      const double to[AXIS_COUNT]) {
    (void)kinematics;
    (void)from;
    (void)to;
    return 1.0; /* of Z */
}

const struct kinematics_ops kinematics_corexy = {
    .forward = forward, .inverse = inverse, .stretch = stretch, .coupled = true};
