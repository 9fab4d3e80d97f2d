/* SPDX-License-Identifier: MIT
 * Into a parked hold (park.h) and out of it. */
#include "machine/parking.h"

#include "machine/answer.h"
#include "machine/drive.h"
#include "machine/inputs.h"
#include "machine/outputs.h"
#include "machine/park.h"
#include "machine/parts.h"
#include "machine/place.h"
#include "machine/preempt.h"
#include "machine/reach.h"
#include "machine/report.h"
#include "machine/state.h"
#include "machine/stored_write.h"
#include "machine/suspend.h"
#include "machine/task.h"
#include "machine/tool_change.h"

#include <stddef.h>

#define TRAVEL_ROUNDING_MM 1e-6

/* ---- into it ---- */

static const char *refuse(const struct machine *machine) {
    const struct machine_host *host = &machine->host;
    if (machine->life.state != MACHINE_HOLD && machine->life.state != MACHINE_DOOR)
        return "Not parked: 0xA3 acts in a hold";
    if (machine->life.state == MACHINE_DOOR && inputs_door_is_open(machine))
        return "Not parked: close the door first";
    if (host->owns || host->job.step == HOST_JOB_BRAKES)
        return "Not parked: a remote host controls motion";
    return machine->park.open ? NULL : park_refuse_stage(machine);
}

static bool ask_again(struct machine *machine) {
    const char *why = refuse(machine);
    machine->park.asked = why == NULL;
    if (why != NULL) {
        rx_end_aside(&machine->lines.rx);
        report_message(machine, why);
    }
    return why == NULL;
}

/* A ~ that came before counts no more. Behind a door suspend.c stops the tools again; in the hold of a lost
 * sender the spindle may run up alone. */
static void stop_restoring(struct machine *machine) {
    suspend_stop_restoring(&machine->suspend);
    if (machine->life.state != MACHINE_HOLD || !machine->outputs.coolant_waits)
        return;
    outputs_suspend(&machine->outputs, true, true);
    outputs_apply(machine);
}

void parking_ask(struct machine *machine, bool resumes) {
    machine->park.resume_asked |= resumes;
    if (ask_again(machine))
        stop_restoring(machine);
    else if (!machine->park.open)
        machine->park.resume_asked = false;
}

static void open(struct machine *machine) {
    preempt_park(machine);
    task_put_aside(&machine->task, &machine->aside.job.task);
    lines_put_aside(&machine->lines, &machine->aside.job.lines);
    interp_put_aside(&machine->interp, &machine->aside.job.interp);
    /* As they are put out: the job's line may not be done. */
    interp_set_tools(&machine->interp, machine->outputs.spindle, machine->interp.gcode.modal.spindle_rpm,
                     machine->outputs.coolant);
    machine->park = (struct machine_park){
        .open = true, .tool = machine->park.tool, .resume_asked = machine->park.resume_asked};
    park_know_place(machine);
    machine->park.top_steps = machine->park.end_steps[AXIS_Z];
}

/* Behind a door tools are off before the hold is one of the operator; in that hold more may be said at any
 * time. */
static bool may_open(const struct machine *machine) {
    const bool door = machine->life.state == MACHINE_DOOR;
    if (machine->park.open && !door)
        return true;
    return drive_is_stopped(machine) && (!door || machine->outputs.suspended);
}

/* M6 by $341: its lines come without 0xA3, where it is clear whose they are (lines.c). */
static bool open_for_tool(struct machine *machine) {
    if (!machine->park.tool)
        return false;
    open(machine);
    if (line_reader_is_between(&machine->aside.job.lines.reader)) /* an LF may follow its CR */
        lines_read_on(&machine->lines, &machine->aside.job.lines);
    tool_change_begin(machine);
    return true;
}

static bool open_poll(struct machine *machine) {
    const bool waits = machine->park.tool && !machine->park.open && machine->life.state != MACHINE_HOLD;
    if (!machine->park.asked || waits || !may_open(machine))
        return false;
    if (!ask_again(machine))
        return true;
    machine->park.asked = false;
    (void)state_go(machine, EVENT_PARK);
    if (!machine->park.open && open_for_tool(machine))
        return true;
    if (!machine->park.open)
        open(machine);
    machine->park.silent = false;
    sender_is_there(&machine->client);
    report_message(machine, "Parked: jog, probe, set zero; ~ returns to the job");
    return true;
}

/* ---- out of it ---- */

static bool stop_poll(struct machine *machine) {
    if (!machine->park.stops || !drive_is_stopped(machine))
        return false;
    machine->park.stops = false;
    park_drop(machine);
    if (machine->task.stage == TASK_JOG) { /* it waited for room */
        task_enter(&machine->task, TASK_NONE);
        answer_line(machine, STATUS_OK);
    }
    return true;
}

/* What the look-ahead has of the job, moved by so much, lies within the travel. Its line's other moves are
 * checked when they are planned. */
static bool may_shift(const struct machine *machine, const double shift_mm[AXIS_COUNT]) {
    const struct settings *settings = &machine->settings;
    const bool mixed = settings->kinematics != KINEMATICS_CARTESIAN;
    double low_mm[AXIS_COUNT], high_mm[AXIS_COUNT];
    motion_bounds(&machine->drive.motion, low_mm, high_mm);
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++) {
        const double travel_mm = (double)settings->max_travel_mm[ax];
        if (shift_mm[ax] == 0.0 || !settings->soft_limits || travel_mm <= 0.0)
            continue;
        if (mixed && ax <= AXIS_Y && !motion_is_planned_out(&machine->drive.motion))
            return false; /* these are joints, and the tool's travel is not theirs */
        if (high_mm[ax] + shift_mm[ax] > TRAVEL_ROUNDING_MM ||
            low_mm[ax] + shift_mm[ax] < -travel_mm - TRAVEL_ROUNDING_MM)
            return false;
    }
    return true;
}

/* The place to return to has the same work coordinates as before. @return false: the travel is too short */
static bool find_return(const struct machine *machine, double shift_mm[AXIS_COUNT],
                        int32_t steps[AXIS_COUNT]) {
    double tool_mm[AXIS_COUNT];
    const int32_t *left_steps = machine->host.job.left_steps;
    bool shifts = false;
    interp_shift_mm(&machine->interp, &machine->aside.job.interp, shift_mm);
    place_tool_mm(machine, left_steps, tool_mm);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        steps[ax] = left_steps[ax];
        tool_mm[ax] += shift_mm[ax];
        shifts |= shift_mm[ax] != 0.0;
    }
    if (!shifts)
        return true;
    if (!may_shift(machine, shift_mm) || !reach_in_travel(machine, tool_mm) ||
        !joints_in_range(&machine->drive.joints, &machine->drive.motion, tool_mm))
        return false;
    park_steps_at(machine, tool_mm, left_steps, steps);
    return true;
}

/* All that the operator has sent is done. */
static bool is_quiet(const struct machine *machine) {
    return machine->task.stage == TASK_NONE && !machine->lines.open && !stored_is_busy(machine) &&
           !machine->park.stops && host_queue_is_empty(&machine->host.queue) && machine_is_standing(machine);
}

/* They start above the job (preempt.c), not where the operator has the tool. */
static void leave_tools_off(struct machine *machine) {
    if (!machine->outputs.suspended)
        return;
    outputs_suspend(&machine->outputs, false, false);
    outputs_set(machine, SPINDLE_OFF, machine->outputs.rpm, 0);
}

/* $346=0: the job continues from above the place where the operator or the measuring has left X and Y. */
static bool stays_there(const struct machine *machine) {
    const struct machine_task *job = &machine->aside.job.task;
    return machine->park.tool && !machine->settings.tool_restore && job->command.move.motion == MOTION_NONE;
}

static void stay(const struct machine *machine, int32_t steps[AXIS_COUNT]) {
    machine_position(machine, steps);
    if (steps[AXIS_Z] < machine->park.top_steps)
        steps[AXIS_Z] = machine->park.top_steps;
}

static void know_stay(struct machine *machine, const int32_t steps[AXIS_COUNT]) {
    double tool_mm[AXIS_COUNT];
    place_tool_mm(machine, steps, tool_mm);
    place_set_program(machine, tool_mm);
}

static bool close_poll(struct machine *machine) {
    const struct machine_park *park = &machine->park;
    const uint8_t *bytes;
    double shift_mm[AXIS_COUNT];
    int32_t steps[AXIS_COUNT];
    if (!park->resume_asked || machine->life.state != MACHINE_HOLD || !is_quiet(machine) ||
        rx_peek_aside(&machine->lines.rx, &bytes) > 0)
        return false;
    if (tool_change_measure(machine))
        return true;
    if (!find_return(machine, shift_mm, steps)) {
        park_keep(machine);
        report_message(machine, "Not resumed: with the new offsets the job leaves the travel");
        return true;
    }
    const bool stays = stays_there(machine);
    if (stays)
        stay(machine, steps);
    rx_end_aside(&machine->lines.rx);
    preempt_unpark(machine, steps, park->top_steps);
    park_take_back(machine, shift_mm);
    task_shift(&machine->task, shift_mm);
    if (stays)
        know_stay(machine, steps);
    leave_tools_off(machine);
    suspend_end(machine);
    return true;
}

/* A ~ that did not count has ended the operator's lines, and those are done. */
static void end_aside(struct machine *machine) {
    const uint8_t *bytes;
    const bool ended = rx_aside(&machine->lines.rx) == RX_ASIDE_ENDED && !machine->park.resume_asked;
    if (ended && machine->park.open && !machine->lines.open && rx_peek_aside(&machine->lines.rx, &bytes) == 0)
        park_end_lines(machine);
}

bool parking_poll(struct machine *machine) {
    end_aside(machine);
    bool any = open_poll(machine);
    any |= stop_poll(machine);
    return close_poll(machine) || any;
}
