/* SPDX-License-Identifier: MIT */
#include "gcode/resolve.h"

#include <string.h> // memcpy

static void copy_row(double to[AXIS_COUNT], const double from[AXIS_COUNT]) {
    memcpy(to, from, AXIS_COUNT * sizeof to[0]);
}

/* A whole number of a tool. @param least  0: no tool is a tool, too */
static enum status tool_number(double number, int least, int *tool) {
    if (number > (double)TOOL_COUNT || number < (double)least)
        return STATUS_TOOL_NUMBER;
    *tool = (int)number;
    return number == *tool ? STATUS_OK : STATUS_NOT_INTEGER;
}

/* G43: H, or else the tool that M6 brought; H0 is not an offset. Axis words belong to the motion of the line.
 */
static enum status tool_from_table(struct resolver *r) {
    double number = r->out->next.tool_in_spindle;
    int tool;
    enum status status;

    if (!resolve_take(r, 'H', &number) && number == 0.0)
        return STATUS_VALUE_MISSING;
    status = tool_number(number, 0, &tool);
    if (status != STATUS_OK)
        return status;
    r->out->tool_length_mm = tool == 0 ? 0.0 : (double)r->state->offsets.tool_mm[tool - 1];
    r->out->tool_table_used = true;
    return STATUS_OK;
}

/* G43.1 takes Z and nothing else. Axis words next to G49 belong to the motion of the line. */
static enum status store_tool_length(struct resolver *r) {
    enum status status = STATUS_OK;

    switch ((enum block_tool_length)r->block->value[GROUP_TOOL_LENGTH]) {
    case TOOL_LENGTH_CANCEL:
        r->out->tool_length_mm = 0.0;
        break;
    case TOOL_LENGTH_DYNAMIC:
        if (r->axis_words != 1u << AXIS_Z)
            return STATUS_TOOL_LENGTH_AXIS;
        r->out->tool_length_mm = resolve_axis_word(r, AXIS_Z);
        break;
    case TOOL_LENGTH_TABLE:
        status = tool_from_table(r);
        break;
    case TOOL_LENGTH_ADD:
        status = (r->unused & WORD_BIT('H')) != 0 ? tool_from_table(r) : STATUS_VALUE_MISSING;
        r->out->tool_length_mm += r->state->offsets.tool_length_mm;
        break;
    }
    if (status != STATUS_OK)
        return status;
    if (!gcode_in_range(AXIS_Z, r->out->tool_length_mm))
        return STATUS_BAD_TARGET;
    r->tool_length_mm = r->out->tool_length_mm;
    r->out->store_tool_length = true;
    return STATUS_OK;
}

/* New offset of one axis so that the position reads as the axis word: G10 L20 solves for the WCS, G92 for
 * itself. */
static double offset_to_read(const struct resolver *r, unsigned axis, double other_offset_mm) {
    /* position = WCS + G92 + tool length (Z only) + word, solved for the offset that is sought. */
    const double tool_length = axis == AXIS_Z ? r->tool_length_mm : 0.0;
    return r->state->position_mm[axis] - other_offset_mm - tool_length - resolve_axis_word(r, axis);
}

/* R of G10 L1: the radius of the tool. It stays as it is without. */
static enum status take_diameter(struct resolver *r) {
    double radius;

    r->out->store_tool_diameter_mm = -1.0f;
    if (!resolve_take(r, 'R', &radius))
        return STATUS_OK;
    if (radius < 0.0)
        return STATUS_NEGATIVE;
    radius *= r->unit_mm;
    if (!gcode_in_range(AXIS_X, radius))
        return STATUS_BAD_TARGET;
    r->out->store_tool_diameter_mm = (float)(2.0 * radius);
    return STATUS_OK;
}

/* G10 L1: Z is the length of tool P, which stays as it is where only R is given. L10: Z is what the position
 * shall read once that tool's length is in force. L11: the same in G59.3 without G92, where a touch-off block
 * may have its place. */
static enum status store_tool(struct resolver *r, int l, double p) {
    const struct gcode_offsets *offsets = &r->state->offsets;
    const double position = r->state->position_mm[AXIS_Z];
    const double word = resolve_axis_word(r, AXIS_Z);
    double length = word;
    int tool;
    enum status status = tool_number(p, 1, &tool);

    if (status == STATUS_OK)
        status = take_diameter(r);
    if (status != STATUS_OK)
        return status;
    if (r->axis_words != 1u << AXIS_Z && r->axis_words != 0)
        return STATUS_TOOL_LENGTH_AXIS;
    if (r->axis_words == 0)
        length = (double)offsets->tool_mm[tool - 1];
    else if (l == 10)
        length = position - r->wcs_mm[AXIS_Z] - offsets->g92_mm[AXIS_Z] - word;
    else if (l == 11)
        length = position - offsets->wcs_mm[WCS_COUNT - 1][AXIS_Z] - word;
    if (!gcode_in_range(AXIS_Z, length))
        return STATUS_BAD_TARGET;
    r->out->store = STORE_TOOL;
    r->out->store_tool = (uint8_t)(tool - 1);
    r->out->store_tool_noted = l == 1;
    r->out->store_tool_mm = (float)length;
    return STATUS_OK;
}

/* The L of G10; fractions are cut off, as in Grbl. @return -1 if it is none that we know */
static int kind_of_g10(double l) {
    static const uint8_t known[] = {1, 2, 10, 11, 20};

    for (unsigned i = 0; i < sizeof known; i++) {
        if (l >= known[i] && l < known[i] + 1)
            return known[i];
    }
    return -1;
}

/* G10 L2: the axis words are the offset. G10 L20: they are what the position shall read. P0 or no P: the
 * active WCS. A bad P is reported before missing axis words. */
static enum status set_offsets(struct resolver *r) {
    const struct gcode_offsets *offsets = &r->state->offsets;
    double l = 0.0, p = 0.0;
    int kind;
    bool is_tool;
    const bool has_p = (r->unused & WORD_BIT('P')) != 0;
    const bool l_or_p = (r->unused & (WORD_BIT('L') | WORD_BIT('P'))) != 0;

    resolve_take(r, 'L', &l);
    resolve_take(r, 'P', &p);
    kind = kind_of_g10(l);
    is_tool = kind == 1 || kind == 10 || kind == 11;
    if (!is_tool && p >= WCS_COUNT + 1)
        return STATUS_WCS_NUMBER;
    if (r->axis_words == 0 && !(kind == 1 && (r->unused & WORD_BIT('R')) != 0))
        return STATUS_NO_AXIS_WORDS;
    if (!l_or_p)
        return STATUS_VALUE_MISSING;
    if (kind < 0 || (kind != 20 && kind != 1 && (r->unused & WORD_BIT('R'))))
        return STATUS_UNSUPPORTED;
    if (is_tool)
        return has_p ? store_tool(r, kind, p) : STATUS_VALUE_MISSING;

    r->out->store_wcs = p >= 1.0 ? (uint8_t)((int)p - 1) : r->out->next.wcs;
    copy_row(r->out->store_mm, offsets->wcs_mm[r->out->store_wcs]);
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++) {
        if (r->axis_words >> axis & 1)
            r->out->store_mm[axis] =
                kind == 2 ? resolve_axis_word(r, axis) : offset_to_read(r, axis, offsets->g92_mm[axis]);
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
        return set_offsets(r);
    case NONMODAL_G92:
        return store_g92(r);
    case NONMODAL_G92_CLEAR:
        copy_row(r->out->store_mm, zeros);
        r->out->store = STORE_G92;
        return STATUS_OK;
    case NONMODAL_G92_SUSPEND:
    case NONMODAL_G92_RESTORE:
        copy_row(r->out->store_mm,
                 r->nonmodal == NONMODAL_G92_SUSPEND ? zeros : r->state->offsets.g92_kept_mm);
        r->out->store = STORE_G92_ALONE;
        return STATUS_OK;
    case NONMODAL_G28_SET:
    case NONMODAL_G30_SET:
        copy_row(r->out->store_mm, r->state->position_mm);
        r->out->store = r->nonmodal == NONMODAL_G28_SET ? STORE_G28 : STORE_G30;
        return STATUS_OK;
    case NONMODAL_NONE:
    case NONMODAL_DWELL:
    case NONMODAL_PROBE_INPUT:
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
    if (status != STATUS_OK || r->out->store == STORE_NOTHING || r->out->store == STORE_TOOL)
        return status;
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++) {
        if (!gcode_in_range(axis, r->out->store_mm[axis]))
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
    /* G92 and G92.1 also set what G92.3 brings back; G92.2 leaves that alone. */
    case STORE_G92:
        copy_row(offsets->g92_kept_mm, command->store_mm);
        copy_row(offsets->g92_mm, command->store_mm);
        break;
    case STORE_G92_ALONE:
        copy_row(offsets->g92_mm, command->store_mm);
        break;
    case STORE_TOOL:
        offsets->tool_mm[command->store_tool] = command->store_tool_mm;
        break;
    case STORE_NOTHING:
        break;
    }
    if (command->store_tool_length)
        offsets->tool_length_mm = command->tool_length_mm;
}
