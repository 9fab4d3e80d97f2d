/* SPDX-License-Identifier: MIT
 * G5 and G5.1, as LinuxCNC has them: XY only, control points by their distance from the ends. */
#include "gcode/resolve.h"

#define TO_CUBIC (2.0 / 3.0) /* a cubic's control points lie this far on the way to the quadratic's one */

/* Two words or none. @return how many were there */
static int take_pair(struct resolver *r, char first, double pair_mm[2]) {
    int count = 0;

    for (int i = 0; i < 2; i++) {
        double number = 0.0;

        count += resolve_take(r, (char)(first + i), &number);
        pair_mm[i] = number * r->unit_mm;
    }
    return count;
}

/* I J from the start, or the mirror image of the last curve's end; P Q from the target. */
static enum status cubic(struct resolver *r, const double *start_mm) {
    struct gcode_move *move = &r->out->move;
    struct gcode_sticky *sticky = &r->out->sticky;
    double from_start_mm[2], from_end_mm[2];
    const int start_words = take_pair(r, 'I', from_start_mm), end_words = take_pair(r, 'P', from_end_mm);

    if (end_words != 2 || start_words == 1 || (start_words == 0 && r->state->modal.motion != MOTION_CUBIC))
        return STATUS_VALUE_MISSING;
    for (unsigned axis = 0; axis < 2; axis++) {
        if (start_words == 0)
            from_start_mm[axis] = -r->state->sticky.spline_mm[axis];
        move->control_mm[0][axis] = start_mm[axis] + from_start_mm[axis];
        move->control_mm[1][axis] = move->target_mm[axis] + from_end_mm[axis];
        sticky->spline_mm[axis] = from_end_mm[axis];
    }
    return STATUS_OK;
}

static enum status quadratic(struct resolver *r, const double *start_mm) {
    struct gcode_move *move = &r->out->move;
    double from_start_mm[2];

    if (take_pair(r, 'I', from_start_mm) == 0 || (from_start_mm[0] == 0.0 && from_start_mm[1] == 0.0))
        return STATUS_ARC_NO_OFFSET;
    for (unsigned axis = 0; axis < 2; axis++) {
        const double control = start_mm[axis] + from_start_mm[axis];

        move->control_mm[0][axis] = start_mm[axis] + TO_CUBIC * from_start_mm[axis];
        move->control_mm[1][axis] = move->target_mm[axis] + TO_CUBIC * (control - move->target_mm[axis]);
    }
    return STATUS_OK;
}

enum status resolve_spline(struct resolver *r) {
    const struct gcode_modal *next = &r->out->next;
    const struct gcode_move *move = &r->out->move;
    enum status status;

    if (next->plane != PLANE_XY || next->feed_mode == FEED_INVERSE_TIME)
        return STATUS_UNSUPPORTED;
    if (r->axis_words >> AXIS_Z != 0)
        return STATUS_AXIS_WORDS_UNUSED;
    r->out->sticky = r->state->sticky;
    status =
        next->motion == MOTION_CUBIC ? cubic(r, r->state->position_mm) : quadratic(r, r->state->position_mm);
    for (unsigned n = 0; status == STATUS_OK && n < 4; n++) {
        if (!gcode_in_range(AXIS_X, move->control_mm[n / 2][n % 2]))
            status = STATUS_BAD_TARGET;
    }
    return status;
}
