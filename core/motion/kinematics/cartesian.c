/* SPDX-License-Identifier: MIT
 * Cartesian: each joint is an axis of the tool. */
#include "motion/kinematics/kinematics.h"

#include <string.h>

static void forward(const struct kinematics *kinematics, const double joints[AXIS_COUNT],
                    double tool_mm[AXIS_COUNT]) {
    (void)kinematics;
    memcpy(tool_mm, joints, AXIS_COUNT * sizeof tool_mm[0]);
}

static void inverse(const struct kinematics *kinematics, const double tool_mm[AXIS_COUNT],
                    const double near[AXIS_COUNT], double joints[AXIS_COUNT]) {
    (void)kinematics;
    (void)near;
    memcpy(joints, tool_mm, AXIS_COUNT * sizeof joints[0]);
}

static double stretch(const struct kinematics *kinematics, const double from[AXIS_COUNT],
                      const double to[AXIS_COUNT]) {
    (void)kinematics;
    (void)from;
    (void)to;
    return 1.0;
}

const struct kinematics_ops kinematics_cartesian = {
    .forward = forward, .inverse = inverse, .stretch = stretch};
