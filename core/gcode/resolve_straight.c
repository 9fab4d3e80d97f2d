/* SPDX-License-Identifier: MIT
 * A straight move and nothing else: the same checks in the same order as resolve.c and resolve_move.c,
 * without what such a line cannot contain. tests/gcode/test_straight.py compares the two. */
#include "gcode/resolve.h"

#include <string.h> // memcpy

/* Machine coordinates of the axis words; the other axes stay. @return false: out of range */
static inline bool find_target(const struct gcode_state *state, const struct gcode_block *block,
                               axis_mask_t axis_words, double unit_mm, double target_mm[AXIS_COUNT]) {
    const struct gcode_offsets *offsets = &state->offsets;
    const double *wcs_mm = offsets->wcs_mm[state->modal.wcs];

    memcpy(target_mm, state->position_mm, sizeof state->position_mm);
    for (unsigned axis = 0, left = axis_words; left != 0; axis++, left >>= 1) {
        double number, zero;

        if (!(left & 1u))
            continue;
        number = block->number[block_axis_word(axis)];
        number = axis < AXIS_A ? number * unit_mm : number; /* degrees have no inches */
        zero = wcs_mm[axis] + offsets->g92_mm[axis];
        zero = axis == AXIS_Z ? zero + offsets->tool_length_mm : zero;
        number += state->modal.incremental ? target_mm[axis] : zero;
        if (!gcode_in_range(axis, number))
            return false;
        target_mm[axis] = number;
    }
    return true;
}

/* F counts degrees when none of XYZ moves; see resolve_move.c. */
static float move_feed(const struct gcode_state *state, float feed_mm_s, const double target_mm[AXIS_COUNT]) {
    for (unsigned axis = 0; axis < AXIS_A; axis++) {
        if (target_mm[axis] != state->position_mm[axis])
            return feed_mm_s;
    }
    return (float)(feed_mm_s / MM_PER_INCH);
}

static HOT enum status straight(const struct gcode_state *state, const struct gcode_block *block,
                                struct gcode_command *command) {
    const double unit_mm = state->modal.inches ? MM_PER_INCH : 1.0;
    const axis_mask_t axis_words = block_axis_words(block);
    const bool moves = axis_words != 0;
    struct gcode_modal *next = &command->next;

    if (axis_words & ~state->axes)
        return STATUS_UNSUPPORTED;
    resolve_nothing(command);
    *next = state->modal;
    next->motion = resolve_motion(state, block);
    next->probe = next->cycle = 0;
    command->spindle = next->spindle;
    command->coolant = next->coolant;
    if (block->words & WORD_BIT('N')) {
        if (block->number[WORD('N')] >= LINE_NUMBER_MAX + 1.0)
            return STATUS_LINE_NUMBER;
        command->line_number = (uint32_t)block->number[WORD('N')];
    }
    if (block->words & WORD_BIT('F'))
        next->feed_mm_s = (float)(block->number[WORD('F')] * unit_mm / S_PER_MIN);
    if (next->motion == MOTION_LINEAR && (moves || block->axes == AXES_MOTION) && next->feed_mm_s <= 0.0f)
        return STATUS_NO_FEED;
    if (!moves)
        return STATUS_OK;
    command->move.motion = next->motion;
    if (!find_target(state, block, axis_words, unit_mm, command->move.target_mm))
        return STATUS_BAD_TARGET;
    if (next->motion == MOTION_LINEAR)
        command->move.feed_mm_s =
            next->inches ? move_feed(state, next->feed_mm_s, command->move.target_mm) : next->feed_mm_s;
    return STATUS_OK;
}

enum status resolve_straight(const struct gcode_state *state, const struct gcode_block *block,
                             struct gcode_command *command) {
    return straight(state, block, command);
}

/* NULL is no refusal: the caller then takes the long way, which finds the error, or the expression. */
const char *gcode_plain_line(const struct gcode_state *state, const char *line,
                             struct gcode_command *command) {
    struct gcode_block block;
    enum status status;

    line = gcode_parse_plain(line, &block);
    if (line == NULL)
        return NULL;
    status = resolve_is_straight(state, &block) ? straight(state, &block, command)
                                                : gcode_resolve(state, &block, command);
    return status == STATUS_OK ? line : NULL;
}
