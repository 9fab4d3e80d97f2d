/* SPDX-License-Identifier: MIT
 * The program's modes and offsets, where something other than its lines changes them. */
#include "machine/interp.h"

#include "machine/actions.h"
#include "machine/parts.h"

#include "gcode/shift.h"

#include <stddef.h>
#include <string.h>

void interp_take_axes(struct machine_interp *interp, uint8_t axis_count) {
    interp->gcode.axes = (axis_mask_t)((1u << axis_count) - 1);
}

void interp_begin(struct machine_interp *interp, const struct machine_board *board) {
    struct gcode_ports *ports = &interp->gcode.ports;
    interp_take_axes(interp, board->axis_count);
    ports->toolsetter = board->toolsetter;
    ports->digital_in = board->digital_inputs;
    ports->digital_out = board->digital_outputs;
    if (board->analog != NULL) {
        ports->analog_in = board->analog->inputs;
        ports->analog_out = board->analog->outputs;
    }
    gcode_modal_init(&interp->gcode.modal);
    interp->params.numbered = interp->numbered;
    interp->params.numbered_room = PARAMS_NUMBERED;
    interp->params.named = interp->named;
    interp->params.named_room = PARAMS_NAMED;
}

void interp_know_spindle(struct machine *machine, enum gcode_spindle spindle) {
    machine->interp.gcode.modal.spindle = machine->task.command.next.spindle = spindle;
}

void interp_know_coolant(struct machine *machine, uint8_t coolant) {
    machine->interp.gcode.modal.coolant = machine->task.command.next.coolant = coolant;
}

static void know(struct gcode_modal *modal, const struct outputs_wish *to, uint8_t coolant) {
    modal->coolant = coolant;
    if (!to->turns)
        return;
    modal->spindle = to->spindle;
    modal->spindle_rpm = to->rpm;
}

void interp_know_wish(struct machine *machine, const struct outputs_wish *to, uint8_t coolant) {
    know(&machine->interp.gcode.modal, to, coolant);
    /* A job that waits keeps what its line had set; it gets its own outputs back (preempt.c). */
    if (!machine->host.owns)
        know(&machine->task.command.next, to, coolant);
}

void interp_forget(struct machine_interp *interp) {
    struct gcode_offsets *offsets = &interp->gcode.offsets;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        offsets->g92_mm[ax] = offsets->g92_kept_mm[ax] = 0.0;
    offsets->tool_length_mm = 0.0;
    gcode_modal_init(&interp->gcode.modal);
    gcode_modes_forget(&interp->gcode);
    params_clear(&interp->params);
}

void interp_check(struct machine_interp *interp, struct gcode_offsets *unchecked, bool begins) {
    if (begins)
        memcpy(unchecked, &interp->gcode.offsets, sizeof *unchecked);
    else /* what a program did to them was not meant */
        memcpy(&interp->gcode.offsets, unchecked, sizeof *unchecked);
}

void interp_put_aside(struct machine_interp *interp, struct interp_aside *aside) {
    struct gcode_modal *modal = &interp->gcode.modal;
    aside->modal = *modal;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        aside->position_mm[ax] = interp->gcode.position_mm[ax];
    gcode_work_offset_mm(&interp->gcode, aside->offset_mm);
    if (modal->feed_mode != FEED_PER_MIN) /* F has another meaning there */
        modal->feed_mm_s = 0.0f;
    modal->feed_mode = FEED_PER_MIN;
    modal->motion = MOTION_RAPID;
    modal->incremental = false;
}

void interp_shift_mm(const struct machine_interp *interp, const struct interp_aside *aside,
                     double shift_mm[AXIS_COUNT]) {
    gcode_wcs_offset_mm(&interp->gcode.offsets, aside->modal.wcs, shift_mm);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        shift_mm[ax] -= aside->offset_mm[ax];
}

void interp_take_back(struct machine_interp *interp, const struct interp_aside *aside,
                      const double shift_mm[AXIS_COUNT]) {
    interp->gcode.modal = aside->modal;
    if (aside->modal.motion == MOTION_CYCLE)
        shift_sticky(&interp->gcode.sticky, shift_mm);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        interp->gcode.position_mm[ax] = aside->position_mm[ax] + shift_mm[ax];
}

void interp_take_probe(struct machine_interp *interp, const struct gcode_command *line,
                       const double probe_mm[AXIS_COUNT], bool ok) {
    double offset_mm[AXIS_COUNT];
    /* The line's modes are not in force yet (task.c), but #5061 are in the work coordinates of this line. */
    interp->gcode.modal.wcs = line->next.wcs;
    gcode_work_offset_mm(&interp->gcode, offset_mm);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        interp->params.probe_mm[ax] = probe_mm[ax] - offset_mm[ax];
    interp->params.probe_ok = ok;
}
