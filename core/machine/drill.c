/* SPDX-License-Identifier: MIT
 * Canned cycles: the actions of gcode/cycle.h, one after the other. */
#include "machine/drill.h"

#include "machine/await.h"
#include "machine/drive.h"
#include "machine/moves.h"
#include "machine/outputs.h"
#include "machine/parts.h"

void drill_begin(struct machine *machine) {
    cycle_begin(&machine->task.cycle, machine->interp.gcode.position_mm, &machine->task.command.move);
    machine->task.action_pending = false;
}

static enum task_stage switch_spindle(struct machine *machine, bool stops) {
    const struct gcode_command *command = &machine->task.command;
    const struct machine_outputs before = machine->outputs;
    outputs_program(machine, stops ? SPINDLE_OFF : command->spindle, command->coolant);
    return await_outputs(machine, &before, TASK_CYCLE);
}

/* The task's own dwell, so that a hold can come between; it returns to this stage. */
static enum task_stage dwell(struct machine *machine, float dwell_s) {
    machine->task.dwell_left_s = (double)dwell_s;
    machine->task.after_dwell = TASK_CYCLE;
    return TASK_DWELLING;
}

/* @return the next stage; TASK_NONE: the action must wait */
static enum task_stage act(struct machine *machine) {
    const struct cycle_action *action = &machine->task.action;
    const bool rapid = action->kind == CYCLE_ACTION_RAPID;
    const float feed_mm_s = rapid ? 0.0f : machine->task.command.move.feed_mm_s;
    if (rapid || action->kind == CYCLE_ACTION_FEED)
        return moves_push(machine, action->target_mm, rapid, feed_mm_s, 0.0f) ? TASK_CYCLE : TASK_NONE;
    if (!drive_rest_reached(machine))
        return TASK_NONE;
    if (action->kind == CYCLE_ACTION_DWELL)
        return dwell(machine, action->dwell_s);
    return switch_spindle(machine, action->kind == CYCLE_ACTION_SPINDLE_STOP);
}

enum task_stage drill_poll(struct machine *machine) {
    for (;;) {
        if (!machine->task.action_pending && !cycle_next(&machine->task.cycle, &machine->task.action))
            return TASK_NONE;
        const enum task_stage next = act(machine);
        machine->task.action_pending = next == TASK_NONE;
        if (next != TASK_CYCLE)
            return next == TASK_NONE ? TASK_CYCLE : next;
    }
}
