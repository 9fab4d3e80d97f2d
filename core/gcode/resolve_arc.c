/* SPDX-License-Identifier: MIT */
#include "gcode/arc.h"
#include "gcode/resolve.h"

#include <math.h> // sqrt fabs: exact

/* Grbl's rule (from EMC) for a centre that is not equally far from both ends. */
#define RADII_DIFFER_ALWAYS_MM 0.005
#define RADII_DIFFER_NEVER_MM  0.5
#define RADII_DIFFER_OF_RADIUS 0.001
#define RADII_DIFFER_MAX       0.5   /* of the radius: beyond it no one meant a circle, whatever $41 says */
#define HALF_CHORD_TOO_LONG_MM 0.005 /* R shorter than half the chord by less is rounding: a half circle */

/* R: the two circles of that radius through both ends have their centres on the perpendicular bisector of the
 * chord, at sqrt(R^2 - (chord/2)^2) from it. Counter-clockwise the short way (R > 0) has its centre on the
 * left. */
static enum status center_from_radius(const struct resolver *r, double radius, double x, double y,
                                      double offset[2]) {
    const double half_chord = 0.5 * sqrt(x * x + y * y);
    double distance;

    if (half_chord == 0.0)
        return STATUS_BAD_TARGET;
    if (half_chord - fabs(radius) > HALF_CHORD_TOO_LONG_MM || radius == 0.0)
        return STATUS_ARC_RADIUS;
    distance =
        fabs(radius) > half_chord ? sqrt((fabs(radius) - half_chord) * (fabs(radius) + half_chord)) : 0.0;
    if ((radius > 0.0) != (r->out->next.motion == MOTION_ARC_CCW))
        distance = -distance;
    offset[0] = 0.5 * x - distance * y / (2.0 * half_chord);
    offset[1] = 0.5 * y + distance * x / (2.0 * half_chord);
    return STATUS_OK;
}

/* I J K: from the start (G91.1), where a missing one is 0, or from the work origin (G90.1), where both are
 * needed. The third of them is dropped, as in Grbl. */
static enum status center_from_offsets(struct resolver *r, const uint8_t axes[2], double offset[2]) {
    bool given[2];

    for (unsigned i = 0; i < 2; i++) {
        double number = 0.0;

        given[i] = resolve_take(r, (char)('I' + axes[i]), &number);
        offset[i] = number * r->unit_mm;
        if (r->out->next.arc_absolute)
            offset[i] += resolve_offset_mm(r, axes[i]) - r->state->position_mm[axes[i]];
    }
    r->unused &= ~WORDS_CENTER;
    if (r->out->next.arc_absolute ? !(given[0] && given[1]) : !(given[0] || given[1]))
        return STATUS_ARC_NO_OFFSET;
    return STATUS_OK;
}

/* Radii that differ make a spiral (arc.c), which ends exactly at the target. */
static bool radii_agree(const struct resolver *r, double start_radius, double target_radius) {
    const double difference = fabs(start_radius - target_radius);

    return difference <= RADII_DIFFER_ALWAYS_MM ||
           (difference <= (double)r->state->arc_radius_tolerance_mm &&
            difference <= RADII_DIFFER_MAX * start_radius) ||
           (difference <= RADII_DIFFER_NEVER_MM && difference <= RADII_DIFFER_OF_RADIUS * start_radius);
}

static double length(double x, double y) {
    return sqrt(x * x + y * y);
}

/* P: how often the arc passes its end. G64 of the line takes its P itself. */
static enum status take_turns(struct resolver *r) {
    double passes = 1.0;

    if (!block_has_group(r->block, GROUP_PATH))
        resolve_take(r, 'P', &passes);
    if (passes < 1.0 || passes > (double)ARC_PASSES_MAX)
        return STATUS_BAD_NUMBER;
    r->out->move.turns = (int32_t)passes - 1;
    return passes == r->out->move.turns + 1.0 ? STATUS_OK : STATUS_NOT_INTEGER;
}

enum status resolve_arc(struct resolver *r) {
    struct gcode_move *move = &r->out->move;
    const uint8_t *axes = arc_plane_axes[r->out->next.plane];
    const double *start = r->state->position_mm;
    const double x = move->target_mm[axes[0]] - start[axes[0]];
    const double y = move->target_mm[axes[1]] - start[axes[1]];
    double offset[2], radius;
    enum status status;

    /* Without a word of the plane it ends where it began: a circle, which R does not define. */
    if (!(r->axis_words & (1u << axes[0] | 1u << axes[1])) &&
        ((r->unused & WORD_BIT('R')) != 0 || (r->unused & WORDS_CENTER) == 0))
        return STATUS_ARC_NO_PLANE_AXIS;
    if ((r->state->axes >> axes[0] & r->state->axes >> axes[1] & 1) == 0)
        return STATUS_UNSUPPORTED; /* half of the plane is not there */
    if (resolve_take(r, 'R', &radius)) {
        status = center_from_radius(r, radius * r->unit_mm, x, y, offset);
    } else {
        status = center_from_offsets(r, axes, offset);
        if (status == STATUS_OK &&
            !radii_agree(r, length(offset[0], offset[1]), length(x - offset[0], y - offset[1])))
            status = STATUS_BAD_TARGET;
    }
    if (status != STATUS_OK)
        return status;
    if (length(offset[0], offset[1]) > GCODE_RADIUS_MAX_MM)
        return STATUS_BAD_TARGET;
    move->plane = r->out->next.plane;
    move->center_mm[0] = start[axes[0]] + offset[0];
    move->center_mm[1] = start[axes[1]] + offset[1];
    return take_turns(r);
}
