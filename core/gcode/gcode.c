/* SPDX-License-Identifier: MIT */
#include "gcode/gcode.h"

#include "gcode/block.h"
#include "gcode/resolve.h"

#include <stddef.h>

void gcode_modal_init(struct gcode_modal *modal) {
    *modal = (struct gcode_modal){
        .motion = MOTION_RAPID,
        .plane = PLANE_XY,
        .path = PATH_BLEND,
        .feed_mode = FEED_PER_MIN,
        .spindle = SPINDLE_OFF,
        .overrides = OVERRIDE_ALL,
    };
}

void gcode_modes_keep(struct gcode_state *state, const struct gcode_command *command) {
    if (command->modes == MODES_FORGET)
        state->is_saved = false;
    if (command->modes != MODES_SAVE && command->modes != MODES_SAVE_FOR_SUB)
        return;
    state->saved = state->modal;
    state->saved_tool_length_mm = state->offsets.tool_length_mm;
    state->is_saved = true;
}

/* machine position = work position + this. */
void gcode_wcs_offset_mm(const struct gcode_offsets *offsets, uint8_t wcs, double out_mm[AXIS_COUNT]) {
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++)
        out_mm[axis] = offsets->wcs_mm[wcs][axis] + offsets->g92_mm[axis];
    out_mm[AXIS_Z] += offsets->tool_length_mm;
}

void gcode_work_offset_mm(const struct gcode_state *state, double out_mm[AXIS_COUNT]) {
    gcode_wcs_offset_mm(&state->offsets, state->modal.wcs, out_mm);
}

enum status gcode_line(const struct gcode_state *state, const char *line, struct gcode_command *command) {
    struct gcode_block block;
    const enum status status = gcode_parse(line, &block);

    return status == STATUS_OK ? gcode_resolve(state, &block, command) : status;
}
