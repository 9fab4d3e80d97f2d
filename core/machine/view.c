/* SPDX-License-Identifier: MIT
 * What the outside sees of a machine's parts. */
#include "machine/host.h"
#include "machine/outputs.h"
#include "machine/parts.h"

enum machine_state machine_state(const struct machine *machine) {
    return machine->life.state;
}

enum alarm machine_alarm(const struct machine *machine) {
    return machine->life.alarm;
}

axis_mask_t machine_homed(const struct machine *machine) {
    return machine->trust.axes;
}

axis_mask_t machine_homes(const struct machine *machine) {
    return machine->life.state == MACHINE_HOME ? machine->homing.axes : 0;
}

uint8_t machine_position_losses(const struct machine *machine) {
    return machine->trust.losses;
}

bool machine_has_line(const struct machine *machine) {
    return machine->task.stage != TASK_NONE;
}

float machine_program_rpm(const struct machine *machine) {
    return machine->interp.gcode.modal.spindle_rpm;
}

bool machine_has_encoder(const struct machine *machine) {
    return machine->interp.gcode.ports.encoder;
}

const struct machine_board *machine_board(const struct machine *machine) {
    return &machine->board;
}

const struct settings *machine_settings(const struct machine *machine) {
    return &machine->settings;
}

struct hal *machine_hal(const struct machine *machine) {
    return machine->hal;
}

struct rx *machine_rx(struct machine *machine) {
    return &machine->lines.rx;
}

struct step *machine_step(struct machine *machine) {
    return &machine->drive.step;
}

const struct machine_host *machine_host(const struct machine *machine) {
    return &machine->host;
}

const struct machine_outputs *machine_outputs(const struct machine *machine) {
    return &machine->outputs;
}
