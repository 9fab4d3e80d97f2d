/* SPDX-License-Identifier: MIT */
#include "motion/joints.h"

#include <math.h>
#include <string.h>

#define MIN_PART 1e-9  /* of a line: no piece is shorter, whatever it bends */
#define AT_ONCE  1e15f /* as fast as the joints can; its square still is a float */
#define LOOK     1e-4  /* joints go so far to see how the tool follows */

static bool is_cartesian(const struct joints *joints) {
    return joints->kinematics.ops == &kinematics_cartesian;
}

void joints_stand(struct joints *joints, const struct motion *motion) {
    joints->kinematics.ops->forward(&joints->kinematics, motion->plan.position_mm, joints->tool_mm);
    joints->done = 0.0;
    joints->part = 1.0;
}

void joints_tool_mm(const struct joints *joints, const struct motion *motion, const int32_t steps[AXIS_COUNT],
                    double tool_mm[AXIS_COUNT]) {
    double at[AXIS_COUNT];
    kinematics_position_mm(steps, motion->plan.limits.steps_per_mm, at);
    joints->kinematics.ops->forward(&joints->kinematics, at, tool_mm);
}

void joints_limit(struct joints *joints, struct motion_limits *limits) {
    const struct kinematics *kinematics = &joints->kinematics;
    joints->deviation_mm = limits->junction_deviation_mm;
    limits->coupled = kinematics->coupled;
    double far[AXIS_COUNT] = {kinematics->travel_mm[0], kinematics->travel_mm[1]};
    double worst = kinematics->ops->stretch(kinematics, far, far);
    if (kinematics->curved != 0 && kinematics->travel_mm[0] <= 0.0)
        limits->junction_deviation_mm = 0.0f; /* no end: each line brings its own */
    else
        limits->junction_deviation_mm = (float)((double)limits->junction_deviation_mm / worst);
}

static double linear_mm(const double from[AXIS_COUNT], const double to[AXIS_COUNT]) {
    double x = to[AXIS_X] - from[AXIS_X], y = to[AXIS_Y] - from[AXIS_Y], z = to[AXIS_Z] - from[AXIS_Z];
    return sqrt(x * x + y * y + z * z);
}

/* The line as one of the joints: the planner counts a feed along X Y Z of what it is given. */
static struct motion_line of_joints(const struct joints *joints, const struct motion_line *line,
                                    const double from_mm[AXIS_COUNT], const double to_mm[AXIS_COUNT],
                                    const double from[AXIS_COUNT], const double to[AXIS_COUNT]) {
    struct motion_line piece = *line;
    double tool_way_mm = linear_mm(from_mm, to_mm), way = linear_mm(from, to);
    double stretch = joints->kinematics.ops->stretch(&joints->kinematics, from, to);
    memcpy(piece.target_mm, to, sizeof piece.target_mm);
    if (tool_way_mm > 0.0)
        piece.feed_mm_s = min_f((float)((double)line->feed_mm_s * (way / tool_way_mm)), AT_ONCE);
    else if (way > 0.0)
        piece.feed_mm_s = AT_ONCE;
    piece.tolerance_mm = (float)((double)max_f(joints->deviation_mm, line->tolerance_mm) / stretch);
    piece.spent_mm = (float)((double)line->spent_mm / stretch);
    return piece;
}

/* The point of the line at a part of it. */
static void point(const double from_mm[AXIS_COUNT], const double to_mm[AXIS_COUNT], double part,
                  double at_mm[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        at_mm[ax] = part < 1.0 ? from_mm[ax] + part * (to_mm[ax] - from_mm[ax]) : to_mm[ax];
}

/* The longest piece from `done` on that bends no more than it may: half of it until it does.
 * @return where it ends, part of the line */
static double next_piece(struct joints *joints, const double from[AXIS_COUNT], const struct motion_line *line,
                         double bend_mm, double at_mm[AXIS_COUNT], double at[AXIS_COUNT]) {
    const struct kinematics *kinematics = &joints->kinematics;
    for (;;) {
        double end = joints->done + joints->part < 1.0 ? joints->done + joints->part : 1.0;
        point(joints->tool_mm, line->target_mm, end, at_mm);
        kinematics->ops->inverse(kinematics, at_mm, from, at);
        if (kinematics->ops->bend_mm(kinematics, from, at) <= bend_mm || joints->part <= MIN_PART)
            return end;
        joints->part *= 0.5;
    }
}

/* A line that the tool leaves while the joints go evenly: as much of it as the tolerance allows. */
static double cut(struct joints *joints, const double from[AXIS_COUNT], const struct motion_line *line,
                  struct motion_line *piece) {
    double from_mm[AXIS_COUNT], at_mm[AXIS_COUNT], at[AXIS_COUNT];
    double tolerance_mm = (double)max_f(joints->deviation_mm, line->tolerance_mm);
    double bend_mm = JOINTS_PART * tolerance_mm > JOINTS_MIN_MM ? JOINTS_PART * tolerance_mm : JOINTS_MIN_MM;
    point(joints->tool_mm, line->target_mm, joints->done, from_mm);
    double end = next_piece(joints, from, line, bend_mm, at_mm, at);
    *piece = of_joints(joints, line, from_mm, at_mm, from, at);
    piece->spent_mm +=
        (float)(bend_mm * (double)piece->tolerance_mm / (tolerance_mm > 0.0 ? tolerance_mm : 1.0));
    piece->duration_s = (float)((double)line->duration_s * (end - joints->done));
    if (end < 1.0)
        piece->flags &= (uint8_t)~MOTION_FLAG_EXACT_STOP;
    return end;
}

double joints_piece(struct joints *joints, const double from[AXIS_COUNT], const struct motion_line *line,
                    struct motion_line *piece) {
    const struct kinematics *kinematics = &joints->kinematics;
    if (kinematics->ops->bend_mm != NULL)
        return cut(joints, from, line, piece);
    *piece = *line;
    if (!is_cartesian(joints)) {
        double from_mm[AXIS_COUNT], at[AXIS_COUNT];
        point(joints->tool_mm, line->target_mm, joints->done, from_mm);
        kinematics->ops->inverse(kinematics, line->target_mm, from, at);
        *piece = of_joints(joints, line, from_mm, line->target_mm, from, at);
    }
    if (line->duration_s > 0.0f)
        piece->duration_s *= (float)(1.0 - joints->done);
    return 1.0;
}

void joints_arrive(struct joints *joints, const double tool_mm[AXIS_COUNT]) {
    memcpy(joints->tool_mm, tool_mm, sizeof joints->tool_mm);
    joints->done = 0.0;
    joints->part = 1.0;
}

bool joints_in_range(const struct joints *joints, const struct motion *motion,
                     const double tool_mm[AXIS_COUNT]) {
    double at[AXIS_COUNT];
    joints->kinematics.ops->inverse(&joints->kinematics, tool_mm, motion->plan.position_mm, at);
    return kinematics_in_range(at, motion->plan.limits.steps_per_mm);
}

/* The way as a unit vector, mm. @return false: none exists */
static bool direction(const struct motion *motion, const int32_t way_steps[AXIS_COUNT],
                      double unit[AXIS_COUNT]) {
    double square = 0.0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        unit[ax] = (double)way_steps[ax] / (double)motion->plan.limits.steps_per_mm[ax];
        square += unit[ax] * unit[ax];
    }
    for (unsigned ax = 0; ax < AXIS_COUNT && square > 0.0; ax++)
        unit[ax] /= sqrt(square);
    return square > 0.0;
}

float joints_tool_speed(const struct joints *joints, const struct motion *motion,
                        const int32_t at_steps[AXIS_COUNT], const int32_t way_steps[AXIS_COUNT],
                        float joints_mm_s) {
    double at[AXIS_COUNT], ahead[AXIS_COUNT], at_mm[AXIS_COUNT], ahead_mm[AXIS_COUNT], unit[AXIS_COUNT];
    if (is_cartesian(joints) || !direction(motion, way_steps, unit))
        return joints_mm_s;
    kinematics_position_mm(at_steps, motion->plan.limits.steps_per_mm, at);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        ahead[ax] = at[ax] + LOOK * unit[ax];
    joints->kinematics.ops->forward(&joints->kinematics, at, at_mm);
    joints->kinematics.ops->forward(&joints->kinematics, ahead, ahead_mm);
    double ratio = linear_mm(at_mm, ahead_mm) / LOOK;
    return ratio > 0.0 ? (float)((double)joints_mm_s * ratio) : joints_mm_s;
}
