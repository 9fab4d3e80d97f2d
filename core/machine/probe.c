/* SPDX-License-Identifier: MIT
 * G38.2 .. G38.5. The step ISR remembers the exact step at which the probe changed; then the motion slows
 * down along its path and stands a little behind it. */
#include "machine/inner.h"

/* G38.4 and G38.5 look for the loss of contact. */
static bool is_away(const struct machine *machine) {
    return machine->command.move.probe >= 4;
}

/* G38.3 and G38.5 may miss. */
static bool may_miss(const struct machine *machine) {
    return (machine->command.move.probe & 1) != 0;
}

static bool is_found(const struct machine *machine) {
    struct hal_inputs inputs;
    hal_inputs_read(machine->hal, &inputs);
    return inputs_probe(machine, &inputs) != is_away(machine);
}

/* All of the line, or as much of it as there is room for. */
static void push(struct machine *machine) {
    const struct gcode_move *move = &machine->command.move;
    struct motion_line line = {.feed_mm_s = move->feed_mm_s,
                               .duration_s = move->inverse_time_s,
                               .line = machine->lines,
                               .flags = MOTION_FLAG_PROBE | MOTION_FLAG_EXACT_STOP};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        line.target_mm[ax] = move->target_mm[ax];
    if (joints_line(&machine->joints, &machine->motion, &line, hal_time_us(machine->hal)))
        motion_flush(&machine->motion);
}

enum task_stage probe_begin(struct machine *machine) {
    if (!task_rest_reached(machine))
        return TASK_PROBE;
    machine->probe_ok = machine->params.probe_ok = false;
    if (is_found(machine)) {
        machine_alarm(machine, ALARM_PROBE_CLOSED);
        return TASK_ALARMED;
    }
    hal_probe_watch(machine->hal, machine->settings.probe_invert != is_away(machine));
    machine->step.probe_hit = false;
    machine->stage = TASK_PROBING;
    machine_apply_override(machine);
    push(machine);
    return TASK_PROBING;
}

/* #5061.., #5070: in the work coordinates of this line. */
static void keep_parameters(struct machine *machine) {
    double offset_mm[AXIS_COUNT];
    machine->gcode.modal.wcs = machine->command.next.wcs;
    gcode_work_offset_mm(&machine->gcode, offset_mm);
    machine_tool_mm(machine, machine->probe_steps, machine->params.probe_mm);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        machine->params.probe_mm[ax] -= offset_mm[ax];
    machine->params.probe_ok = machine->probe_ok;
}

static void finish(struct machine *machine, bool found) {
    if (machine->step.probe_hit)
        step_probe_position(&machine->step, machine->probe_steps);
    else if (found || may_miss(machine))
        machine_position(machine, machine->probe_steps);
    machine->probe_ok = found;
    keep_parameters(machine);
    machine->step.probe_hit = false;
    machine_drop_motion(machine);
    machine->stage = TASK_NONE;
    machine_apply_override(machine);
    if (!found && !may_miss(machine))
        machine_alarm(machine, ALARM_PROBE_MISSED);
}

enum task_stage probe_poll(struct machine *machine) {
    if (machine->step.probe_hit)
        motion_hold(&machine->motion);
    else if (machine->joints.done > 0.0)
        push(machine);
    if (!machine_is_stopped(machine))
        return TASK_PROBING;
    finish(machine, machine->step.probe_hit || is_found(machine));
    return TASK_PROBED;
}
