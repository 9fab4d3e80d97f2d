/* SPDX-License-Identifier: MIT
 * Switches and buttons. */
#include "machine/inputs.h"

#include "machine/drive.h"
#include "machine/parts.h"
#include "machine/place.h"
#include "machine/switches.h"

#include <stddef.h>

axis_mask_t inputs_ganged(const struct machine *machine) {
    const struct hal_ganged *ganged = machine->board.ganged;
    return ganged != NULL ? (axis_mask_t)(ganged->axes & machine->interp.gcode.axes) : 0;
}

axis_mask_t inputs_squared(const struct machine *machine) {
    const struct hal_ganged *ganged = machine->board.ganged;
    const axis_mask_t axes = inputs_ganged(machine);
    return axes == 0 ? 0 : (axis_mask_t)(axes & ganged->switched & ~machine->settings.one_switch_mask);
}

/* One byte of switch_lines.limits each: minimum, maximum, and both again of second motors, which count
 * only for axes where it has a switch. */
static axis_mask_t limits_of(const struct machine *machine, struct switch_lines lines) {
    uint32_t first = lines.limits | lines.limits >> 8, second = lines.limits >> 16 | lines.limits >> 24;
    return (axis_mask_t)((first | (second & inputs_squared(machine))) & machine->interp.gcode.axes);
}

axis_mask_t inputs_limits(const struct machine *machine) {
    return limits_of(machine, machine->edges.switches.closed);
}

/* The switch that homing runs to: the home switch, or of an axis without one the limit at its end by $23. */
static axis_mask_t homing_of(const struct machine *machine, struct switch_lines lines, unsigned motor) {
    uint32_t limits = motor == FIRST_MOTOR ? lines.limits : lines.limits >> 16;
    uint32_t home = motor == FIRST_MOTOR ? lines.homes : lines.homes >> 8;
    uint32_t to_min = machine->settings.homing_dir_mask, own = machine->board.home_axes;
    uint32_t limit = (limits & to_min) | (limits >> 8 & ~to_min);
    axis_mask_t axes = motor == FIRST_MOTOR ? machine->interp.gcode.axes : inputs_squared(machine);
    return (axis_mask_t)(((home & own) | (limit & ~own)) & axes);
}

axis_mask_t inputs_homing(const struct machine *machine, unsigned motor) {
    return homing_of(machine, machine->edges.switches.closed, motor);
}

bool inputs_probe(const struct machine *machine, const struct hal_inputs *inputs, enum hal_probe probe) {
    return probe == HAL_TOOLSETTER ? inputs->toolsetter == machine->settings.toolsetter_invert
                                   : inputs->probe == machine->settings.probe_invert;
}

bool inputs_door_is_open(const struct machine *machine) {
    return machine->inputs.door;
}

/* Limits that stop the machine. Homing runs onto those that it looks for, but not onto the others. */
static axis_mask_t hard_limits(const struct machine *machine) {
    if (!machine->settings.hard_limits || machine->life.state == MACHINE_ALARM)
        return 0;
    return machine->life.state == MACHINE_HOME ? machine->board.home_axes : machine->interp.gcode.axes;
}

/* Where lines have closed that homing looks for: it counts if they stay closed. */
static void mark_edges(struct machine *machine, struct switch_lines fresh) {
    struct machine_edges *edges = &machine->edges;
    int32_t position[AXIS_COUNT];
    unsigned axes[MOTOR_COUNT], any = 0;
    for (unsigned motor = 0; motor < MOTOR_COUNT; motor++) {
        axes[motor] = edges->latch[motor] == 0 ? 0 : homing_of(machine, fresh, motor);
        any |= axes[motor];
    }
    if (any == 0)
        return;
    place_axis_steps(machine, position);
    for (unsigned motor = 0; motor < MOTOR_COUNT; motor++)
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            if ((axes[motor] >> ax & 1) != 0)
                edges->mark[motor][ax] = position[ax];
}

/* Remember where the switches come on that homing looks for. @param marked  they have waited, and were
 * marked at their edge */
static void latch_switches(struct machine *machine, unsigned motor, axis_mask_t marked) {
    struct machine_edges *edges = &machine->edges;
    axis_mask_t latch = inputs_homing(machine, motor) & edges->latch[motor];
    latch &= (axis_mask_t)~edges->latched[motor];
    int32_t position[AXIS_COUNT];
    if (latch == 0)
        return;
    place_axis_steps(machine, position);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if ((latch >> ax & 1) != 0)
            edges->at[motor][ax] = (marked >> ax & 1) != 0 ? edges->mark[motor][ax] : position[ax];
    edges->latched[motor] |= latch;
}

/* Take the switches that are closed for good. @param waited  those of them that had to wait for it */
static void take_switches(struct machine *machine, struct switch_lines waited) {
    struct machine_edges *edges = &machine->edges;
    axis_mask_t limits = inputs_limits(machine);
    axis_mask_t fresh = limits & (axis_mask_t)~edges->known;
    edges->known = limits;
    if ((fresh & hard_limits(machine)) != 0)
        edges->hard_limit = true;
    /* In the interrupt, not in the poll that reports it: the machine stops also when every task is late. */
    if (edges->estop || edges->hard_limit)
        step_halt(&machine->drive.step);
    if (edges->estop) { /* not for a limit: the motors hold the position, as Grbl's do */
        hal_estop(machine->hal, machine->motors.inverted, machine->drive.prep.timing.pwm.dark);
        edges->cuts++;
    }
    for (unsigned motor = 0; motor < MOTOR_COUNT; motor++)
        if (edges->latch[motor] != 0)
            latch_switches(machine, motor, homing_of(machine, waited, motor));
}

static void see_switches(struct machine *machine) {
    struct hal_inputs inputs;
    const bool high = machine->settings.limit_invert, filters = machine->settings.switch_filter_us != 0;
    hal_inputs_read(machine->hal, &inputs);
    if (inputs.estop)
        machine->edges.estop = true;
    mark_edges(machine, switches_edge(&machine->edges.switches, switch_lines_of(&inputs.switches, high),
                                      switch_lines_of(&inputs.pins, high), filters));
}

static void time_switches(struct machine *machine) {
    if (switches_start_timer(&machine->edges.switches))
        hal_switch_timer_start(machine->hal, machine->settings.switch_filter_us);
}

void machine_edge_isr(struct machine *machine) {
    see_switches(machine);
    take_switches(machine, (struct switch_lines){0, 0});
    time_switches(machine);
}

void machine_switch_timer_isr(struct machine *machine) {
    see_switches(machine);
    take_switches(machine, switches_time(&machine->edges.switches));
    time_switches(machine);
}

void inputs_begin(struct machine *machine) {
    hal_inputs_read(machine->hal, &machine->inputs);
    switches_begin(&machine->edges.switches,
                   switch_lines_of(&machine->inputs.switches, machine->settings.limit_invert));
    machine->edges.known = inputs_limits(machine);
}

static void look(void *arg) {
    machine_edge_isr(arg);
}

void inputs_look(struct machine *machine) {
    drive_on_motion_side(machine, look, machine);
}
