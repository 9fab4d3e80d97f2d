/* SPDX-License-Identifier: MIT
 * The tool's straight lines -> straight lines of the joints, before the planner. [task]
 *
 *   motion_tool_line() -> joints_piece() -> kinematics (inverse; cut into pieces where it bends)
 *
 * A joint's line is the tool's where the kinematics is linear. Else the line is cut so finely that the tool
 * stays within JOINTS_PART of the tolerance of it while the joints go evenly (kinematics_ops.bend_mm bounds
 * that); what is left of the tolerance is the planner's. Both are measured where the tool is: a tolerance in
 * joints is divided by how far a joint moves the tool at most. The feed is the tool's, piece by piece. */
#ifndef WIFICNC_MOTION_JOINTS_H
#define WIFICNC_MOTION_JOINTS_H

#include "motion/kinematics/kinematics.h"
#include "motion/motion.h"

/** Of the tolerance, for cutting; and the least of it, so that a tolerance of 0 ends. */
#define JOINTS_PART   0.25
#define JOINTS_MIN_MM 0.0005

struct joints {
    struct kinematics kinematics;
    double tool_mm[AXIS_COUNT]; /* where the newest whole line ends */
    double done;                /* part of the line under way that is planned already; 0: none is */
    double part;                /* length of its last piece */
    float deviation_mm;         /* $11 */
};

/** The tool is where motion is planned to. After motion_init() and motion_reset(). */
void joints_stand(struct joints *joints, const struct motion *motion);

/** Where the joints are -> where the tool is. */
void joints_tool_mm(const struct joints *joints, const struct motion *motion, const int32_t steps[AXIS_COUNT],
                    double tool_mm[AXIS_COUNT]);

/** Limits of the joints and where they are known to hold for the tool: junction_deviation_mm becomes what is
 * right everywhere. @param limits  junction_deviation_mm: $11 */
void joints_limit(struct joints *joints, struct motion_limits *limits);

/** The next piece of a line of the tool, from `done` on, as a line of the joints.
 *  @param from  where the joints are planned to
 *  @return where it ends: part of the line, 1: all of it */
double joints_piece(struct joints *joints, const double from[AXIS_COUNT], const struct motion_line *line,
                    struct motion_line *piece);

/** All pieces of a line are planned. */
void joints_arrive(struct joints *joints, const double tool_mm[AXIS_COUNT]);

/** Steps of all joints fit the counters there. */
bool joints_in_range(const struct joints *joints, const struct motion *motion,
                     const double tool_mm[AXIS_COUNT]);

/** Speed of the tool at this place, when the joints move at this speed in the direction of way_steps, mm/s.
 */
float joints_tool_speed(const struct joints *joints, const struct motion *motion,
                        const int32_t at_steps[AXIS_COUNT], const int32_t way_steps[AXIS_COUNT],
                        float joints_mm_s);

#endif
