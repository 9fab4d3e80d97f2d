/* SPDX-License-Identifier: MIT
 * Lines that were resolved before work zero or the tool length was changed. */
#include "gcode/shift.h"

static unsigned normal_of(enum gcode_plane plane) {
    const uint8_t *axes = arc_plane_axes[plane];
    return (unsigned)(AXIS_X + AXIS_Y + AXIS_Z) - axes[0] - axes[1];
}

static void shift_drill(struct gcode_drill *drill, double shift_mm) {
    drill->r_mm += shift_mm;
    drill->bottom_mm += shift_mm;
    drill->clear_mm += shift_mm;
}

/* What a move has no use for is not filled in, and is not read either. */
void shift_move(struct gcode_move *move, const double shift_mm[AXIS_COUNT]) {
    if (move->motion == MOTION_NONE)
        return;
    shift_point(move->target_mm, shift_mm);
    if (move->via || move->motion == MOTION_CYCLE || move->motion == MOTION_THREAD)
        shift_point(move->via_mm, shift_mm);
    if (move->motion == MOTION_CYCLE)
        shift_drill(&move->drill, shift_mm[normal_of(move->plane)]);
    for (unsigned i = 0; i < 2; i++) {
        if (move->motion == MOTION_ARC_CW || move->motion == MOTION_ARC_CCW)
            move->center_mm[i] += shift_mm[arc_plane_axes[move->plane][i]];
        for (unsigned xy = 0; xy < 2 && (move->motion == MOTION_CUBIC || move->motion == MOTION_QUADRATIC);
             xy++)
            move->control_mm[i][xy] += shift_mm[xy];
    }
}

void shift_arc(struct arc *arc, const double shift_mm[AXIS_COUNT]) {
    arc->center_mm[0] += shift_mm[arc->ax0];
    arc->center_mm[1] += shift_mm[arc->ax1];
    shift_point(arc->start_mm, shift_mm);
    shift_point(arc->target_mm, shift_mm);
}

void shift_spline(struct spline *spline, const double shift_mm[AXIS_COUNT]) {
    for (unsigned i = 0; i < 4; i++)
        for (unsigned xy = 0; xy < 2; xy++)
            spline->point_mm[i][xy] += shift_mm[xy];
    shift_point(spline->target_mm, shift_mm);
}

void shift_cycle(struct cycle *cycle, const double shift_mm[AXIS_COUNT]) {
    shift_drill(&cycle->drill, shift_mm[cycle->normal]);
    shift_point(cycle->at_mm, shift_mm);
    for (unsigned i = 0; i < 2; i++)
        cycle->last_mm[i] += shift_mm[cycle->axes[i]];
}

void shift_sticky(struct gcode_sticky *sticky, const double shift_mm[AXIS_COUNT]) {
    sticky->initial_mm += shift_mm[normal_of(sticky->plane)];
}
