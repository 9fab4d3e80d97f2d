/* SPDX-License-Identifier: MIT
 * Whether the machine can go where a line wants it to: asked before anything of the line is done. */
#include "machine/reach.h"

#include "machine/parts.h"

static enum status reach(const struct machine *machine, const double from_mm[AXIS_COUNT],
                         const double to_mm[AXIS_COUNT]) {
    if (!kinematics_reaches(&machine->drive.joints.kinematics, from_mm, to_mm))
        return STATUS_UNREACHABLE;
    return joints_in_range(&machine->drive.joints, &machine->drive.motion, to_mm) ? STATUS_OK
                                                                                  : STATUS_BAD_TARGET;
}

/* Every point of a curve that will be planned. */
static enum status reach_curve(const struct machine *machine, const struct gcode_move *move) {
    double tolerance_mm = (double)machine->settings.arc_tolerance_mm, point_mm[AXIS_COUNT];
    const double *from_mm = machine->interp.gcode.position_mm;
    bool splines = move->motion == MOTION_CUBIC || move->motion == MOTION_QUADRATIC;
    union {
        struct arc arc;
        struct spline spline;
    } curve;
    if (splines)
        spline_begin(&curve.spline, from_mm, move, tolerance_mm);
    else
        arc_begin(&curve.arc, from_mm, move, tolerance_mm);
    while (splines ? spline_next(&curve.spline, point_mm) : arc_next(&curve.arc, point_mm))
        if (!kinematics_reaches(&machine->drive.joints.kinematics, point_mm, point_mm))
            return STATUS_UNREACHABLE;
    return STATUS_OK;
}

static bool is_curve(const struct gcode_move *move) {
    return move->motion == MOTION_ARC_CW || move->motion == MOTION_ARC_CCW || move->motion == MOTION_CUBIC ||
           move->motion == MOTION_QUADRATIC;
}

enum status reach_move(const struct machine *machine, const struct gcode_move *move) {
    const double *from_mm = machine->interp.gcode.position_mm;
    enum status status = STATUS_OK;
    if (move->motion == MOTION_NONE)
        return STATUS_OK;
    if (move->motion == MOTION_THREAD && machine->drive.joints.kinematics.curved != 0)
        return STATUS_THREAD_KINEMATICS;
    if (move->via || move->motion == MOTION_CYCLE || move->motion == MOTION_THREAD) {
        status = reach(machine, from_mm, move->via_mm);
        from_mm = move->via_mm;
    }
    if (status == STATUS_OK && machine->drive.joints.kinematics.curved != 0 && is_curve(move)) {
        status = reach_curve(machine, move);
        from_mm = move->target_mm;
    }
    return status == STATUS_OK ? reach(machine, from_mm, move->target_mm) : status;
}

bool reach_in_travel(const struct machine *machine, const double target_mm[AXIS_COUNT]) {
    const struct settings *settings = &machine->settings;
    if (!settings->soft_limits)
        return true;
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++) {
        double travel_mm = (double)settings->max_travel_mm[ax];
        if ((machine->drive.joints.kinematics.curved >> ax & 1) != 0)
            continue; /* reach.c */
        if (travel_mm > 0.0 && (target_mm[ax] > 0.0 || target_mm[ax] < -travel_mm))
            return false;
    }
    return true;
}

/* The part of the way, 0 to 1, after which an axis leaves its travel. */
static double part_inside(const struct machine *machine, unsigned ax, double from_mm, double target_mm) {
    double travel_mm = (double)machine->settings.max_travel_mm[ax];
    double end_mm = target_mm > 0.0 ? 0.0 : -travel_mm;
    bool leaves = target_mm > 0.0 || target_mm < -travel_mm;
    bool began_inside = from_mm <= 0.0 && from_mm >= -travel_mm;
    bool has_ends = travel_mm > 0.0 && (machine->drive.joints.kinematics.curved >> ax & 1) == 0;
    return has_ends && leaves && began_inside ? (end_mm - from_mm) / (target_mm - from_mm) : 1.0;
}

void reach_shorten(const struct machine *machine, const double from_mm[AXIS_COUNT],
                   double target_mm[AXIS_COUNT]) {
    double part[AXIS_COUNT], least = 1.0;
    if (!machine->settings.soft_limits)
        return;
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++) {
        part[ax] = part_inside(machine, ax, from_mm[ax], target_mm[ax]);
        if (part[ax] < least)
            least = part[ax];
    }
    if (least >= 1.0)
        return;
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++) {
        double end_mm = target_mm[ax] > 0.0 ? 0.0 : -(double)machine->settings.max_travel_mm[ax];
        /* The end itself: rounding must not lie beyond it. */
        target_mm[ax] = part[ax] <= least ? end_mm : from_mm[ax] + least * (target_mm[ax] - from_mm[ax]);
    }
}

/* A line that leaves the travel brings everything to a controlled stop. */
bool reach_leaves_travel(struct machine *machine, const double target_mm[AXIS_COUNT]) {
    if (reach_in_travel(machine, target_mm))
        return false;
    motion_hold(&machine->drive.motion);
    return true;
}
