/* SPDX-License-Identifier: MIT
 * Canned cycles: the actions of gcode/cycle.h, one after the other. */
#include "machine/drill.h"

#include "machine/drive.h"
#include "machine/moves.h"
#include "machine/outputs.h"
#include "machine/parts.h"

void drill_begin(struct machine *machine) {
    cycle_begin(&machine->task.cycle, machine->interp.gcode.position_mm, &machine->task.command.move);
    machine->task.action_pending = false;
}

/* @return false: it must wait */
static bool act(struct machine *machine) {
    const struct gcode_command *command = &machine->task.command;
    const struct cycle_action *action = &machine->task.action;
    bool rapid = action->kind == CYCLE_ACTION_RAPID;
    if (rapid || action->kind == CYCLE_ACTION_FEED)
        return moves_push(machine, action->target_mm, rapid, rapid ? 0.0f : command->move.feed_mm_s, 0.0f);
    if (!drive_rest_reached(machine))
        return false;
    if (action->kind == CYCLE_ACTION_DWELL)
        machine->task.dwell_left_s = (double)action->dwell_s;
    else
        outputs_program(machine, action->kind == CYCLE_ACTION_SPINDLE_STOP ? SPINDLE_OFF : command->spindle,
                        command->coolant);
    return true;
}

enum task_stage drill_poll(struct machine *machine) {
    for (;;) {
        if (!machine->task.action_pending && !cycle_next(&machine->task.cycle, &machine->task.action))
            return TASK_NONE;
        machine->task.action_pending = !act(machine);
        if (machine->task.action_pending)
            return TASK_CYCLE;
        /* The task's own dwell, so that a hold can come between; it returns to this stage. */
        if (machine->task.action.kind == CYCLE_ACTION_DWELL) {
            machine->task.after_dwell = TASK_CYCLE;
            return TASK_DWELLING;
        }
    }
}
