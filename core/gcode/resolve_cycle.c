/* SPDX-License-Identifier: MIT
 * Canned cycles, as RS274/NGC describes them. */
#include "gcode/arc.h"
#include "gcode/resolve.h"

#include <string.h> // memcpy

#define MIN_PECK_MM 1e-6 /* less is rounding, and part of the peck before */

enum { KNOWN_R = 1, KNOWN_Z = 2, KNOWN_Q = 4, KNOWN_P = 8 };

/* Words that a cycle needs, in its line or from the line before. */
static uint8_t needed_words(enum gcode_cycle cycle) {
    switch (cycle) {
    case CYCLE_CHIP:
    case CYCLE_PECK:
        return KNOWN_R | KNOWN_Z | KNOWN_Q;
    case CYCLE_DWELL:
    case CYCLE_BORE_STOP:
    case CYCLE_BORE_DWELL:
        return KNOWN_R | KNOWN_Z | KNOWN_P;
    case CYCLE_DRILL:
    case CYCLE_BORE:
    default:
        return KNOWN_R | KNOWN_Z;
    }
}

/* What the lines before left behind: nothing if they were about another plane; levels and words only if this
 * is the same cycle in the same distance mode. */
static void inherit(const struct resolver *r, unsigned normal) {
    const struct gcode_modal *before = &r->state->modal;
    const struct gcode_modal *next = &r->out->next;
    struct gcode_sticky *sticky = &r->out->sticky;
    const bool goes_on = before->motion == MOTION_CYCLE && r->state->sticky.plane == next->plane;

    *sticky = r->state->sticky;
    if (!goes_on || before->cycle != next->cycle || sticky->incremental != next->incremental)
        sticky->known = 0;
    /* The level that G98 returns to is where the first cycle of a row began, not where the last hole left
     * the tool. */
    if (!goes_on)
        sticky->initial_mm = r->state->position_mm[normal];
    sticky->plane = next->plane;
    sticky->incremental = next->incremental;
}

static enum status take_words(struct resolver *r, unsigned normal) {
    struct gcode_sticky *sticky = &r->out->sticky;
    const uint8_t needed = needed_words((enum gcode_cycle)r->out->next.cycle);
    double number;

    if (resolve_take(r, 'R', &number)) {
        sticky->r_mm = number * r->unit_mm;
        sticky->known |= KNOWN_R;
    }
    if (r->axis_words >> normal & 1u) {
        sticky->z_mm = resolve_axis_word(r, normal);
        sticky->known |= KNOWN_Z;
    }
    if ((needed & KNOWN_Q) != 0 && resolve_take(r, 'Q', &number)) {
        if (number == 0.0)
            return STATUS_BAD_NUMBER;
        sticky->q_mm = number * r->unit_mm;
        sticky->known |= KNOWN_Q;
    }
    if ((needed & KNOWN_P) != 0 && resolve_take(r, 'P', &number)) {
        sticky->p_s = (float)number;
        sticky->known |= KNOWN_P;
    }
    return (sticky->known & needed) == needed ? STATUS_OK : STATUS_VALUE_MISSING;
}

static enum status take_repeats(struct resolver *r) {
    double number = 1.0;

    resolve_take(r, 'L', &number);
    if (number < 0.0)
        return STATUS_NEGATIVE;
    if (number < 1.0 || number > (double)DRILL_REPEATS_MAX)
        return STATUS_BAD_NUMBER;
    r->out->move.drill.repeats = (uint32_t)number;
    return number == r->out->move.drill.repeats ? STATUS_OK : STATUS_NOT_INTEGER;
}

/* R counts from the work zero or (G91) from the level before the row of cycles, as G98 does: G99 would else
 * begin each hole deeper than the one before. Z counts from the work zero or from R. */
static enum status find_levels(struct resolver *r, unsigned normal) {
    const struct gcode_modal *next = &r->out->next;
    const struct gcode_sticky *sticky = &r->out->sticky;
    struct gcode_drill *drill = &r->out->move.drill;
    const double zero = next->incremental ? sticky->initial_mm : resolve_offset_mm(r, normal);

    drill->r_mm = zero + sticky->r_mm;
    drill->bottom_mm = (next->incremental ? drill->r_mm : zero) + sticky->z_mm;
    drill->clear_mm = drill->r_mm;
    if (!next->retract_to_r && sticky->initial_mm > drill->r_mm)
        drill->clear_mm = sticky->initial_mm;
    if (!gcode_in_range(AXIS_Z, drill->r_mm) || !gcode_in_range(AXIS_Z, drill->bottom_mm) ||
        drill->bottom_mm > drill->r_mm)
        return STATUS_BAD_TARGET;
    return STATUS_OK;
}

static enum status find_holes(struct resolver *r, const uint8_t axes[2]) {
    struct gcode_move *move = &r->out->move;
    const bool incremental = r->out->next.incremental;

    memcpy(move->target_mm, r->state->position_mm, sizeof move->target_mm);
    for (unsigned i = 0; i < 2; i++) {
        double word;

        move->drill.step_mm[i] = 0.0;
        if (!(r->axis_words >> axes[i] & 1u))
            continue;
        word = resolve_axis_word(r, axes[i]);
        if (incremental) {
            move->drill.step_mm[i] = word;
            word = move->target_mm[axes[i]] + word * move->drill.repeats;
        } else {
            word += resolve_offset_mm(r, axes[i]);
        }
        if (!gcode_in_range(axes[i], word))
            return STATUS_BAD_TARGET;
        move->target_mm[axes[i]] = word;
    }
    return STATUS_OK;
}

/* Pecks of Q down to the bottom; the last one takes what is left, and swallows the rounding. */
static enum status find_pecks(struct resolver *r) {
    struct gcode_drill *drill = &r->out->move.drill;
    const struct gcode_sticky *sticky = &r->out->sticky;
    const double depth = drill->r_mm - drill->bottom_mm;

    drill->pecks = 1;
    drill->dwell_s = sticky->known & KNOWN_P ? sticky->p_s : -1.0f;
    drill->peck_mm = depth;
    if ((sticky->known & KNOWN_Q) == 0)
        return STATUS_OK;
    drill->peck_mm = sticky->q_mm;
    if (depth >= (double)DRILL_PECKS_MAX * sticky->q_mm)
        return STATUS_BAD_NUMBER;
    if (depth > MIN_PECK_MM)
        drill->pecks = 1 + (uint32_t)((depth - MIN_PECK_MM) / sticky->q_mm);
    return STATUS_OK;
}

enum status resolve_cycle(struct resolver *r) {
    const struct gcode_modal *next = &r->out->next;
    struct gcode_move *move = &r->out->move;
    const uint8_t *axes = arc_plane_axes[next->plane];
    const unsigned normal = (unsigned)(AXIS_X + AXIS_Y + AXIS_Z) - axes[0] - axes[1];
    enum status status;

    if (next->feed_mode == FEED_INVERSE_TIME)
        return STATUS_UNSUPPORTED;
    if (r->axis_words >> AXIS_A != 0)
        return STATUS_AXIS_WORDS_UNUSED;
    move->drill.cycle = (enum gcode_cycle)next->cycle;
    if (move->drill.cycle == CYCLE_BORE_STOP && next->spindle == SPINDLE_OFF)
        return STATUS_VALUE_MISSING; /* M3 or M4 */
    inherit(r, normal);
    status = take_words(r, normal);
    if (status == STATUS_OK)
        status = take_repeats(r);
    if (status == STATUS_OK)
        status = find_levels(r, normal);
    if (status == STATUS_OK)
        status = find_holes(r, axes);
    if (status == STATUS_OK)
        status = find_pecks(r);
    if (status != STATUS_OK)
        return status;
    move->plane = next->plane;
    move->feed_mm_s = resolve_feed_mm_s(next);
    move->target_mm[normal] = move->drill.clear_mm;
    /* The deepest point: with the target it spans all that the cycle touches, for the checks of travel and
     * reach. */
    memcpy(move->via_mm, move->target_mm, sizeof move->via_mm);
    move->via_mm[normal] = move->drill.bottom_mm;
    return STATUS_OK;
}
