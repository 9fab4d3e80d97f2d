/* SPDX-License-Identifier: MIT
 * G38.2 .. G38.5. The step ISR remembers the exact step at which the probe changed; then the motion slows
 * down along its path and rests a little behind it. */
#include "machine/probe.h"

#include "machine/drive.h"
#include "machine/inputs.h"
#include "machine/overrides.h"
#include "machine/park.h"
#include "machine/parts.h"
#include "machine/place.h"
#include "machine/reset.h"

/* G38.4 and G38.5 look for the loss of contact. */
static bool is_away(const struct machine *machine) {
    return machine->task.command.move.probe >= 4;
}

/* G38.3 and G38.5 may miss. */
static bool may_miss(const struct machine *machine) {
    return (machine->task.command.move.probe & 1) != 0;
}

/* G65 P5 of the lines before. */
static enum hal_probe input_of(const struct machine *machine) {
    return machine->task.command.next.toolsetter ? HAL_TOOLSETTER : HAL_PROBE;
}

static bool is_found(const struct machine *machine) {
    struct hal_inputs inputs;
    hal_inputs_read(machine->hal, &inputs);
    return inputs_probe(machine, &inputs, input_of(machine)) != is_away(machine);
}

/* All of the line, or as much of it as there is room for. */
static void push(struct machine *machine) {
    const struct gcode_move *move = &machine->task.command.move;
    if (machine->park.open) {
        (void)park_move(machine, SEGMENT_PROBE); /* the queue is empty */
        return;
    }
    struct motion_line line = {.feed_mm_s = move->feed_mm_s,
                               .duration_s = move->inverse_time_s,
                               .line = machine->lines.count,
                               .flags = MOTION_FLAG_PROBE | MOTION_FLAG_EXACT_STOP | MOTION_FLAG_UNSHAPED};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        line.target_mm[ax] = move->target_mm[ax];
    if (motion_tool_line(&machine->drive.motion, &machine->drive.joints, &line, hal_time_us(machine->hal)))
        motion_flush(&machine->drive.motion);
}

bool probe_has_failed(const struct machine *machine) {
    return !machine->probe.ok && !may_miss(machine);
}

enum task_stage probe_begin(struct machine *machine) {
    if (!drive_rest_reached(machine))
        return TASK_PROBE;
    machine->probe.ok = machine->interp.params.probe_ok = false;
    if (is_found(machine) && machine->park.open)
        return TASK_ALARMED; /* the job is kept: an error, no alarm */
    if (is_found(machine)) {
        reset_alarm(machine, ALARM_PROBE_CLOSED);
        return TASK_ALARMED;
    }
    /* The level to look for, then the watch itself, then motion: the ISR looks with the first span. */
    const bool inverts = input_of(machine) == HAL_TOOLSETTER ? machine->settings.toolsetter_invert
                                                             : machine->settings.probe_invert;
    hal_probe_watch(machine->hal, input_of(machine), inverts != is_away(machine));
    step_watch_probe(&machine->drive.step);
    task_enter(&machine->task, TASK_PROBING);
    if (!machine->park.open)
        overrides_apply(machine);
    push(machine);
    return TASK_PROBING;
}

static void finish(struct machine *machine, bool found) {
    if (machine->drive.step.probe_hit)
        step_probe_position(&machine->drive.step, machine->probe.steps);
    else if (found || may_miss(machine))
        /* Seen only at rest, or allowed to miss: then the place is where the axes are. As in Grbl, a G38.2
         * that fails leaves the place of the probe before. */
        machine_position(machine, machine->probe.steps);
    machine->probe.ok = found;
    double found_mm[AXIS_COUNT];
    place_tool_mm(machine, machine->probe.steps, found_mm);
    interp_take_probe(&machine->interp, &machine->task.command, found_mm, found);
    step_watch_probe(&machine->drive.step);
    if (machine->park.open) { /* and overrides are the job's */
        park_drop(machine);
        return;
    }
    drive_drop(machine);
    task_enter(&machine->task, TASK_NONE);
    overrides_apply(machine);
    if (!found && !may_miss(machine))
        reset_alarm(machine, ALARM_PROBE_MISSED);
}

/* In a parked hold the queue may still be held from before, when its motion has not begun. */
static bool is_over(const struct machine *machine) {
    const bool goes = machine->park.open && !machine->park.stops && !machine->drive.step.probe_hit;
    return drive_is_stopped(machine) && !(goes && !host_queue_is_empty(&machine->host.queue));
}

enum task_stage probe_poll(struct machine *machine) {
    if (machine->drive.step.probe_hit)
        motion_hold(&machine->drive.motion);
    else if (machine->drive.joints.done > 0.0 && !machine->park.open)
        push(machine);
    if (!is_over(machine))
        return TASK_PROBING;
    finish(machine, machine->drive.step.probe_hit || is_found(machine));
    return TASK_PROBED;
}
