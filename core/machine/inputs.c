/* SPDX-License-Identifier: MIT
 * Switches and buttons. */
#include "machine/inner.h"

axis_mask_t inputs_limits(const struct machine *machine, const struct hal_inputs *inputs) {
    unsigned hit = machine->settings.limit_invert ? (unsigned)inputs->limit_min | inputs->limit_max
                                                  : ~((unsigned)inputs->limit_min & inputs->limit_max);
    return (axis_mask_t)(hit & machine->gcode.axes);
}

axis_mask_t inputs_homing(const struct machine *machine, const struct hal_inputs *inputs) {
    unsigned to_min = machine->settings.homing_dir_mask;
    unsigned high = (inputs->limit_min & to_min) | (inputs->limit_max & ~to_min);
    return (axis_mask_t)((machine->settings.limit_invert ? high : ~high) & machine->gcode.axes);
}

bool inputs_probe(const struct machine *machine, const struct hal_inputs *inputs) {
    return inputs->probe == machine->settings.probe_invert;
}

bool inputs_door_is_open(const struct machine *machine) {
    return machine->inputs.door;
}

static bool hard_limits_watch(const struct machine *machine) {
    return machine->settings.hard_limits && machine->state != MACHINE_ALARM && machine->state != MACHINE_HOME;
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
    if (fresh != 0 && hard_limits_watch(machine))
        edges->hard_limit = true;
    if (edges->estop || edges->hard_limit)
        step_halt(&machine->step);
    axis_mask_t latch = inputs_homing(machine, &inputs) & edges->latch & (axis_mask_t)~edges->latched;
    if (latch == 0)
        return;
    int32_t position[AXIS_COUNT];
    machine_position(machine, position);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if ((latch >> ax & 1) != 0)
            edges->at[ax] = position[ax];
    edges->latched |= latch;
}

static uint32_t pressed(const struct hal_inputs *now, const struct hal_inputs *before) {
    uint32_t bits = 0;
    bits |= now->hold && !before->hold ? REALTIME_HOLD : 0;
    bits |= now->start && !before->start ? REALTIME_RESUME : 0;
    bits |= now->reset && !before->reset ? REALTIME_RESET : 0;
    return bits;
}

bool inputs_poll(struct machine *machine) {
    struct hal_inputs before = machine->inputs;
    hal_inputs_read(machine->hal, &machine->inputs);
    const struct hal_inputs *now = &machine->inputs;
    if (machine->edges.known != inputs_limits(machine, now)) /* a board without edge interrupts for them */
        machine_edge_isr(machine);
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
