/* SPDX-License-Identifier: MIT
 * Canned cycles: the actions of gcode/cycle.h, one after the other. */
#include "machine/inner.h"

void drill_begin(struct machine *machine) {
    cycle_begin(&machine->cycle, machine->gcode.position_mm, &machine->command.move);
    machine->action_pending = false;
}

/* @return false: it must wait */
static bool act(struct machine *machine) {
    const struct gcode_command *command = &machine->command;
    const struct cycle_action *action = &machine->action;
    bool rapid = action->kind == CYCLE_ACTION_RAPID;
    if (rapid || action->kind == CYCLE_ACTION_FEED)
        return task_push_line(machine, action->target_mm, rapid, rapid ? 0.0f : command->move.feed_mm_s,
                              0.0f);
    if (!task_rest_reached(machine))
        return false;
    if (action->kind == CYCLE_ACTION_DWELL)
        machine->dwell_left_s = (double)action->dwell_s;
    else
        task_set_outputs(machine, action->kind == CYCLE_ACTION_SPINDLE_STOP ? SPINDLE_OFF : command->spindle,
                         command->coolant);
    return true;
}

enum task_stage drill_poll(struct machine *machine) {
    for (;;) {
        if (!machine->action_pending && !cycle_next(&machine->cycle, &machine->action))
            return TASK_NONE;
        machine->action_pending = !act(machine);
        if (machine->action_pending)
            return TASK_CYCLE;
        if (machine->action.kind == CYCLE_ACTION_DWELL) {
            machine->after_dwell = TASK_CYCLE;
            return TASK_DWELLING;
        }
    }
}
