/* SPDX-License-Identifier: MIT */
#include "gcode/resolve.h"

#include <string.h> // memcpy

static void copy_row(double to[AXIS_COUNT], const double from[AXIS_COUNT]) {
    memcpy(to, from, AXIS_COUNT * sizeof to[0]);
}

/* G43.1 takes Z and nothing else. G49 takes no axis word: Grbl 1.1h drops them silently, we refuse. */
static enum status store_tool_length(struct resolver *r) {
    if (r->block->value[GROUP_TOOL_LENGTH] == TOOL_LENGTH_CANCEL) {
        if (r->axis_words != 0)
            return STATUS_AXIS_WORDS_UNUSED;
        r->out->tool_length_mm = 0.0;
    } else {
        if (r->axis_words != 1u << AXIS_Z)
            return STATUS_TOOL_LENGTH_AXIS;
        r->out->tool_length_mm = resolve_axis_word(r, AXIS_Z);
        if (!resolve_in_range(r->out->tool_length_mm))
            return STATUS_BAD_TARGET;
    }
    r->out->store_tool_length = true;
    return STATUS_OK;
}

/* New offset of one axis so that the position reads as the axis word: G10 L20 solves for the WCS, G92 for
 * itself. */
static double offset_to_read(const struct resolver *r, unsigned axis, double other_offset_mm) {
    const double tool_length = axis == AXIS_Z ? r->state->offsets.tool_length_mm : 0.0;
    return r->state->position_mm[axis] - other_offset_mm - tool_length - resolve_axis_word(r, axis);
}

/* G10 L2: the axis words are the offset. G10 L20: they are what the position shall read. P0 or no P: the
 * active WCS. A bad P is told before missing axis words. */
static enum status store_wcs(struct resolver *r) {
    const struct gcode_offsets *offsets = &r->state->offsets;
    double l = 0.0, p = 0.0;
    const bool l_or_p = (r->unused & (WORD_BIT('L') | WORD_BIT('P'))) != 0;

    resolve_take(r, 'L', &l);
    resolve_take(r, 'P', &p);
    if (p >= WCS_COUNT + 1)
        return STATUS_WCS_NUMBER;
    if (r->axis_words == 0)
        return STATUS_NO_AXIS_WORDS;
    if (!l_or_p)
        return STATUS_VALUE_MISSING;
    l = l >= 0.0 && l < 256.0 ? (double)(int)l : -1.0; /* Grbl cuts the fraction off */
    if ((l != 2.0 && l != 20.0) || (l == 2.0 && (r->unused & WORD_BIT('R'))))
        return STATUS_UNSUPPORTED;

    r->out->store_wcs = p >= 1.0 ? (uint8_t)((int)p - 1) : r->out->next.wcs;
    copy_row(r->out->store_mm, offsets->wcs_mm[r->out->store_wcs]);
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++) {
        if (r->axis_words >> axis & 1)
            r->out->store_mm[axis] =
                l == 2.0 ? resolve_axis_word(r, axis) : offset_to_read(r, axis, offsets->g92_mm[axis]);
    }
    r->out->store = STORE_WCS;
    return STATUS_OK;
}

static enum status store_g92(struct resolver *r) {
    const struct gcode_offsets *offsets = &r->state->offsets;

    if (r->axis_words == 0)
        return STATUS_NO_AXIS_WORDS;
    copy_row(r->out->store_mm, offsets->g92_mm);
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++) {
        if (r->axis_words >> axis & 1)
            r->out->store_mm[axis] = offset_to_read(r, axis, r->wcs_mm[axis]);
    }
    r->out->store = STORE_G92;
    return STATUS_OK;
}

static enum status store_nonmodal(struct resolver *r) {
    static const double zeros[AXIS_COUNT];

    switch (r->nonmodal) {
    case NONMODAL_SET_OFFSETS:
        return store_wcs(r);
    case NONMODAL_G92:
        return store_g92(r);
    case NONMODAL_G92_CLEAR:
        copy_row(r->out->store_mm, zeros);
        r->out->store = STORE_G92;
        return STATUS_OK;
    case NONMODAL_G28_SET:
    case NONMODAL_G30_SET:
        copy_row(r->out->store_mm, r->state->position_mm);
        r->out->store = r->nonmodal == NONMODAL_G28_SET ? STORE_G28 : STORE_G30;
        return STATUS_OK;
    case NONMODAL_NONE:
    case NONMODAL_DWELL:
    case NONMODAL_G28:
    case NONMODAL_G30:
    case NONMODAL_MACHINE_COORDS:
        break;
    }
    return STATUS_OK;
}

enum status resolve_stores(struct resolver *r) {
    enum status status = STATUS_OK;

    if (block_has_group(r->block, GROUP_TOOL_LENGTH))
        status = store_tool_length(r);
    if (status == STATUS_OK)
        status = store_nonmodal(r);
    if (status != STATUS_OK || r->out->store == STORE_NOTHING)
        return status;
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++) {
        if (!resolve_in_range(r->out->store_mm[axis]))
            return STATUS_BAD_TARGET;
    }
    return STATUS_OK;
}

void gcode_offsets_apply(struct gcode_offsets *offsets, const struct gcode_command *command) {
    switch (command->store) {
    case STORE_WCS:
        copy_row(offsets->wcs_mm[command->store_wcs], command->store_mm);
        break;
    case STORE_G28:
        copy_row(offsets->g28_mm, command->store_mm);
        break;
    case STORE_G30:
        copy_row(offsets->g30_mm, command->store_mm);
        break;
    case STORE_G92:
        copy_row(offsets->g92_mm, command->store_mm);
        break;
    case STORE_NOTHING:
        break;
    }
    if (command->store_tool_length)
        offsets->tool_length_mm = command->tool_length_mm;
}
