/* SPDX-License-Identifier: MIT
 * $J=: moves that can be called off. */
#include "machine/inner.h"

enum status jog_begin(struct machine *machine, const char *text) {
    struct gcode_command *command = &machine->command;
    enum status status = gcode_jog(&machine->gcode, text, command);
    if (status != STATUS_OK)
        return status;
    status = reach_move(machine, &command->move);
    if (status != STATUS_OK)
        return status;
    if (!task_in_travel(machine, command->move.target_mm))
        return STATUS_JOG_TRAVEL;
    machine_transition(machine, MACHINE_JOGS);
    machine_apply_override(machine);
    machine->stage = TASK_JOG;
    return STATUS_OK;
}

enum task_stage jog_poll(struct machine *machine) {
    const struct gcode_move *move = &machine->command.move;
    notes_add(&machine->notes,
              &(struct line_note){.line = machine->lines, .number = machine->command.line_number});
    struct motion_line line = {.feed_mm_s = move->feed_mm_s,
                               .line = machine->lines,
                               .note = machine->notes.count,
                               .flags = MOTION_FLAG_JOG};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        line.target_mm[ax] = move->target_mm[ax];
    if (!joints_line(&machine->joints, &machine->motion, &line, hal_time_us(machine->hal)))
        return TASK_JOG;
    task_set_position(machine, move->target_mm);
    return TASK_NONE;
}

void jog_cancel(struct machine *machine) {
    machine->cancelling = true;
    motion_hold(&machine->motion);
    if (machine->stage != TASK_JOG)
        return;
    machine->stage = TASK_NONE; /* the jog that waited for room */
    machine_answer(machine, STATUS_OK);
}

void jog_end_cancel(struct machine *machine) {
    machine->cancelling = false;
    machine_drop_motion(machine);
    machine_transition(machine, MACHINE_RESTS); /* a door that cancelled it stays open */
    machine_apply_override(machine);
}
