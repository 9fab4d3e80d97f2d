/* SPDX-License-Identifier: MIT
 * M66: a dwell that an input can end. What it found is #5399. */
#include "machine/await.h"

#include "machine/parts.h"

static bool level_now(const struct machine *machine) {
    return (machine->inputs.digital >> machine->task.command.port & 1u) != 0;
}

enum task_stage await_begin(struct machine *machine, enum task_stage next) {
    const struct gcode_command *command = &machine->task.command;
    if (machine->life.state == MACHINE_CHECK)
        return next;
    if (command->port_kind == PORT_ANALOG_IN) {
        machine->interp.params.input =
            (double)machine->board.analog->read(machine->hal, (unsigned)command->port);
        return next;
    }
    if (command->wait == WAIT_NOT) {
        machine->interp.params.input = level_now(machine);
        return next;
    }
    machine->interp.params.input = -1.0; /* as long as it has not come */
    machine->task.input_awaited = true;
    machine->task.input_before = level_now(machine);
    machine->task.dwell_left_s = (double)command->wait_s;
    machine->task.after_dwell = next;
    return TASK_DWELLING;
}

static bool has_come(enum gcode_wait wait, bool before, bool now) {
    switch (wait) {
    case WAIT_RISE:
        return now && !before;
    case WAIT_FALL:
        return before && !now;
    case WAIT_HIGH:
        return now;
    case WAIT_LOW:
        return !now;
    case WAIT_NOT:
        break;
    }
    return true;
}

void await_poll(struct machine *machine) {
    if (!machine->task.input_awaited)
        return;
    const bool now = level_now(machine);
    if (has_come(machine->task.command.wait, machine->task.input_before, now)) {
        machine->interp.params.input = now;
        machine->task.input_awaited = false;
        machine->task.dwell_left_s = 0.0;
        task_note_further(&machine->task);
    }
    machine->task.input_before = now;
}
