/* SPDX-License-Identifier: MIT
 * M66: a dwell that an input can end. What it found is #5399. */
#include "machine/inner.h"

static bool level_now(const struct machine *machine) {
    return (machine->inputs.digital >> machine->command.port & 1u) != 0;
}

enum task_stage await_begin(struct machine *machine, enum task_stage next) {
    const struct gcode_command *command = &machine->command;
    if (machine->state == MACHINE_CHECK)
        return next;
    if (command->port_kind == PORT_ANALOG_IN) {
        machine->params.input = (double)machine->board.analog->read(machine->hal, (unsigned)command->port);
        return next;
    }
    if (command->wait == WAIT_NOT) {
        machine->params.input = level_now(machine);
        return next;
    }
    machine->params.input = -1.0; /* as long as it has not come */
    machine->input_awaited = true;
    machine->input_before = level_now(machine);
    machine->dwell_left_s = (double)command->wait_s;
    machine->after_dwell = next;
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
    if (!machine->input_awaited)
        return;
    const bool now = level_now(machine);
    if (has_come(machine->command.wait, machine->input_before, now)) {
        machine->params.input = now;
        machine->input_awaited = false;
        machine->dwell_left_s = 0.0;
    }
    machine->input_before = now;
}
