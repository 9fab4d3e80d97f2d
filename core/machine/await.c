/* SPDX-License-Identifier: MIT
 * What a line waits for at rest: an input, and what it has switched. */
#include "machine/await.h"

#include "machine/outputs.h"
#include "machine/parts.h"
#include "machine/run_up.h"

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
    machine->task.awaits = AWAIT_INPUT;
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

static uint32_t later_us(uint32_t a, uint32_t b) {
    return a > b ? a : b;
}

static enum task_stage wait(struct machine *machine, uint32_t us, enum task_stage next) {
    if (us == 0)
        return next;
    machine->task.dwell_left_s = (double)us * 1e-6;
    machine->task.after_dwell = next;
    return TASK_DWELLING;
}

enum task_stage await_reversal(struct machine *machine) {
    const enum gcode_spindle now = machine->outputs.spindle, next = machine->task.command.spindle;
    if (machine->life.state == MACHINE_CHECK || machine->settings.laser_mode || next == SPINDLE_OFF)
        return TASK_NONE;
    if (now != SPINDLE_OFF && now != next && machine->settings.spindle_off_delay_s > 0.0f)
        outputs_program(machine, SPINDLE_OFF, machine->outputs.coolant);
    const uint32_t us = run_up_stop_us(machine, next);
    return us > 0 ? wait(machine, us, TASK_OUTPUTS) : TASK_NONE;
}

/* One wait for both: spindle and coolant start together. */
enum task_stage await_outputs(struct machine *machine, const struct machine_outputs *before,
                              enum task_stage next) {
    const struct machine_outputs *now = &machine->outputs;
    bool checks;
    if (machine->park.open) /* the job waits for it before it continues */
        return next;
    uint32_t us = run_up_due_us(machine, &checks);
    run_up_take(&machine->run_up);
    if (before->spindle != SPINDLE_OFF && now->spindle == SPINDLE_OFF)
        us = run_up_stop_us(machine, SPINDLE_OFF);
    if ((now->coolant & ~before->coolant) != 0)
        us = later_us(us, (uint32_t)(machine->settings.coolant_delay_s * 1e6f));
    if (checks)
        machine->task.awaits = AWAIT_SPINDLE;
    return wait(machine, us + (checks ? RUN_UP_PATIENCE_US : 0), next);
}

static void end_wait(struct machine *machine) {
    machine->task.awaits = AWAIT_NOTHING;
    machine->task.dwell_left_s = 0.0;
    task_note_further(&machine->task);
}

static void look_at_spindle(struct machine *machine) {
    if (run_up_look(machine, (uint32_t)(machine->task.dwell_left_s * 1e6)) == RUN_UP_DONE)
        end_wait(machine);
}

static void look_at_input(struct machine *machine) {
    const bool now = level_now(machine);
    if (has_come(machine->task.command.wait, machine->task.input_before, now)) {
        machine->interp.params.input = now;
        end_wait(machine);
    }
    machine->task.input_before = now;
}

void await_poll(struct machine *machine) {
    if (machine->task.awaits == AWAIT_INPUT)
        look_at_input(machine);
    else if (machine->task.awaits == AWAIT_SPINDLE)
        look_at_spindle(machine);
}
