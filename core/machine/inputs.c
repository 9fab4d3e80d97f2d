/* SPDX-License-Identifier: MIT
 * Switches and buttons. */
#include "machine/inner.h"

#include <stddef.h>

axis_mask_t inputs_ganged(const struct machine *machine) {
    const struct hal_ganged *ganged = machine->board.ganged;
    return ganged != NULL ? (axis_mask_t)(ganged->axes & machine->gcode.axes) : 0;
}

axis_mask_t inputs_limits(const struct machine *machine, const struct hal_inputs *inputs) {
    unsigned flip = machine->settings.limit_invert ? 0 : ~0u;
    unsigned first = (inputs->limit_min ^ flip) | (inputs->limit_max ^ flip);
    unsigned second = (inputs->second_min ^ flip) | (inputs->second_max ^ flip);
    return (axis_mask_t)((first | (second & inputs_ganged(machine))) & machine->gcode.axes);
}

axis_mask_t inputs_homing(const struct machine *machine, const struct hal_inputs *inputs, unsigned motor) {
    unsigned to_min = machine->settings.homing_dir_mask;
    unsigned low = motor == FIRST_MOTOR ? inputs->limit_min : inputs->second_min;
    unsigned high = motor == FIRST_MOTOR ? inputs->limit_max : inputs->second_max;
    unsigned limit = (low & to_min) | (high & ~to_min), own = machine->board.home_axes;
    unsigned home = motor == FIRST_MOTOR ? inputs->home : inputs->second_home;
    unsigned level = (home & own) | (limit & ~own);
    axis_mask_t axes = motor == FIRST_MOTOR ? machine->gcode.axes : inputs_ganged(machine);
    return (axis_mask_t)((machine->settings.limit_invert ? level : ~level) & axes);
}

bool inputs_probe(const struct machine *machine, const struct hal_inputs *inputs) {
    return inputs->probe == machine->settings.probe_invert;
}

bool inputs_door_is_open(const struct machine *machine) {
    return machine->inputs.door;
}

/* Limits that stop the machine. Homing runs onto those that it looks for, but not onto the others. */
static axis_mask_t hard_limits(const struct machine *machine) {
    if (!machine->settings.hard_limits || machine->state == MACHINE_ALARM)
        return 0;
    return machine->state == MACHINE_HOME ? machine->board.home_axes : machine->gcode.axes;
}

/* Remember where the switches come on that homing looks for. */
static void latch_switches(struct machine *machine, const struct hal_inputs *inputs, unsigned motor) {
    struct machine_edges *edges = &machine->edges;
    axis_mask_t latch = inputs_homing(machine, inputs, motor) & edges->latch[motor];
    latch &= (axis_mask_t)~edges->latched[motor];
    int32_t position[AXIS_COUNT];
    if (latch == 0)
        return;
    machine_axis_steps(machine, position);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if ((latch >> ax & 1) != 0)
            edges->at[motor][ax] = position[ax];
    edges->latched[motor] |= latch;
}

void machine_edge_isr(struct machine *machine) {
    struct machine_edges *edges = &machine->edges;
    struct hal_inputs inputs;
    hal_inputs_read(machine->hal, &inputs);
    axis_mask_t limits = inputs_limits(machine, &inputs);
    axis_mask_t fresh = limits & (axis_mask_t)~edges->known;
    edges->known = limits;
    if (inputs.estop)
        edges->estop = true;
    if ((fresh & hard_limits(machine)) != 0)
        edges->hard_limit = true;
    if (edges->estop || edges->hard_limit)
        step_halt(&machine->step);
    for (unsigned motor = 0; motor < MOTOR_COUNT; motor++)
        if (edges->latch[motor] != 0)
            latch_switches(machine, &inputs, motor);
}

static uint32_t pressed(const struct hal_inputs *now, const struct hal_inputs *before) {
    uint32_t bits = 0;
    bits |= now->hold && !before->hold ? REALTIME_HOLD : 0;
    bits |= now->start && !before->start ? REALTIME_RESUME : 0;
    bits |= now->reset && !before->reset ? REALTIME_RESET : 0;
    return bits;
}

static void look(void *arg) {
    machine_edge_isr(arg);
}

void inputs_look(struct machine *machine) {
    machine_on_motion_side(machine, look, machine);
}

bool inputs_poll(struct machine *machine) {
    struct hal_inputs before = machine->inputs;
    hal_inputs_read(machine->hal, &machine->inputs);
    const struct hal_inputs *now = &machine->inputs;
    if (machine->edges.known != inputs_limits(machine, now)) /* a board without edge interrupts for them */
        inputs_look(machine);
    if ((now->estop || machine->edges.estop) && !machine->critical && !machine->restart) {
        machine_alarm_critical(machine, ALARM_ESTOP);
        return true;
    }
    if (machine->edges.hard_limit) {
        machine_alarm_critical(machine, ALARM_HARD_LIMIT);
        return true;
    }
    rx_request(&machine->rx, pressed(now, &before));
    if (now->door && !machine->critical && !machine->restart && machine->state != MACHINE_DOOR) {
        enum machine_state state = machine->state;
        suspend_open_door(machine);
        return machine->state != state;
    }
    return false;
}
