/* SPDX-License-Identifier: MIT
 * A parked hold: between 0xA3 and ~ the lines are the operator's. */
#include "machine/park.h"

#include "machine/answer.h"
#include "machine/dial.h"
#include "machine/drive.h"
#include "machine/host_motion.h"
#include "machine/parts.h"
#include "machine/place.h"
#include "machine/reach.h"

#include "base/minmax.h"

#include <math.h>
#include <stddef.h>

#define ALIKE      0.02f  /* of the speed: rounding to whole steps */
#define MOVE_MAX_S 4000.0 /* the time of one segment is 32 bits of us */

const struct machine_task *park_job_task(const struct machine *machine) {
    return machine->park.open ? &machine->aside.job.task : &machine->task;
}

void park_know_place(struct machine *machine) {
    struct machine_park *park = &machine->park;
    double tool_mm[AXIS_COUNT];
    machine_position(machine, park->end_steps);
    place_tool_mm(machine, park->end_steps, tool_mm);
    place_set_program(machine, tool_mm);
}

const char *park_refuse_stage(const struct machine *machine) {
    switch (machine->task.stage) {
    case TASK_THREAD:
        return "Not parked: the tool follows the spindle";
    case TASK_PROBE:
    case TASK_PROBING:
    case TASK_PROBED:
    case TASK_ALARMED:
        return "Not parked: the program is probing";
    default:
        if (machine->spindle_sync.cutting)
            return "Not parked: the tool follows the spindle";
        return machine->task.awaits != AWAIT_NOTHING
                   ? "Not parked: the program waits for an input or the spindle"
                   : NULL;
    }
}

/* ---- motion ---- */

static double way_mm(const double from_mm[AXIS_COUNT], const double to_mm[AXIS_COUNT]) {
    double linear = 0.0, all = 0.0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        const double way = to_mm[ax] - from_mm[ax];
        all += way * way;
        linear += ax <= AXIS_Z ? way * way : 0.0;
    }
    return sqrt(linear > 0.0 ? linear : all);
}

void park_steps_at(const struct machine *machine, const double tool_mm[AXIS_COUNT],
                   const int32_t near[AXIS_COUNT], int32_t steps[AXIS_COUNT]) {
    const struct kinematics *kinematics = &machine->drive.joints.kinematics;
    const float *steps_per_mm = machine->drive.motion.plan.limits.steps_per_mm;
    double near_mm[AXIS_COUNT], joints[AXIS_COUNT];
    kinematics_position_mm(near, steps_per_mm, near_mm);
    kinematics->ops->inverse(kinematics, tool_mm, near_mm, joints);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        steps[ax] = near[ax];
    kinematics_target_steps(joints, steps_per_mm, machine->board.axis_count, steps);
}

/* At this feed, or as fast as the slowest axis can. */
static double seconds_of(const struct machine *machine, const int32_t steps[AXIS_COUNT]) {
    const struct gcode_move *move = &machine->task.command.move;
    double seconds = way_mm(machine->interp.gcode.position_mm, move->target_mm) / (double)move->feed_mm_s;
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++) {
        const double least = fabs((double)steps[ax]) / (double)machine->host.queue.limits.rate_steps_s[ax];
        seconds = least > seconds ? least : seconds;
    }
    return seconds;
}

/* A jog that continues the one before at its speed follows it without a stop; the queue would forgive a
 * network host more. */
static bool follows_on(const struct host_queue *queue, const struct host_queue_segment *segment) {
    const struct host_queue_slot *before = &queue->slots[(queue->head - 1) & (HOST_QUEUE_SIZE - 1)];
    const float before_s = (float)before->duration_ns * 1e-9f, own_s = (float)segment->duration_us * 1e-6f;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        const float from = (float)before->steps[ax] / before_s, to = (float)segment->steps[ax] / own_s;
        if (fabsf(to - from) > ALIKE * fabsf(from) + 1.0f / min_f(before_s, own_s))
            return false;
    }
    return true;
}

bool park_move(struct machine *machine, uint8_t flags) {
    struct machine_park *park = &machine->park;
    const double *target_mm = machine->task.command.move.target_mm;
    struct host_queue_segment segment = {.flags = (uint8_t)(flags | SEGMENT_LAST)};
    int32_t target[AXIS_COUNT];
    bool moves = false;
    park_steps_at(machine, target_mm, park->end_steps, target);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        segment.steps[ax] = target[ax] - park->end_steps[ax];
        moves |= segment.steps[ax] != 0;
    }
    if (moves) {
        segment.duration_us = (uint32_t)(1e6 * seconds_of(machine, segment.steps)) + 1;
        if (!host_queue_is_empty(&machine->host.queue) && !follows_on(&machine->host.queue, &segment))
            return false;
        if (!host_move_self(machine, &segment))
            return false;
    }
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        park->end_steps[ax] = target[ax];
    if (target[AXIS_Z] > park->top_steps)
        park->top_steps = target[AXIS_Z];
    place_set_program(machine, target_mm);
    return true;
}

void park_drop(struct machine *machine) {
    host_stop_self(machine);
    park_know_place(machine);
}

void park_stop(struct machine *machine) {
    struct machine_park *park = &machine->park;
    dial_stop(machine);
    suspend_count_stop(&machine->suspend);
    park->resume_asked = false;
    park->stops = park->open;
    tool_change_stop(&machine->tool_change);
}

/* ---- what the operator may do ---- */

enum status park_check_jog(const struct machine *machine, const struct gcode_move *move) {
    if (machine->drive.joints.kinematics.curved != 0)
        return STATUS_PARKED_KINEMATICS;
    if (way_mm(machine->interp.gcode.position_mm, move->target_mm) > MOVE_MAX_S * (double)move->feed_mm_s)
        return STATUS_BAD_TARGET;
    return reach_in_travel(machine, move->target_mm) ? STATUS_OK : STATUS_JOG_TRAVEL;
}

static enum status check_move(const struct machine *machine, const struct gcode_move *move) {
    if (move->motion == MOTION_NONE)
        return STATUS_OK;
    return move->motion == MOTION_PROBE && !move->via ? park_check_jog(machine, move) : STATUS_PARKED;
}

bool park_job_sets_offset(const struct machine *machine) {
    const struct machine_task *job = &machine->aside.job.task;
    return job->stage != TASK_NONE && (job->command.store != STORE_NOTHING || job->command.store_tool_length);
}

static bool changes_offset(const struct machine *machine, const struct gcode_command *command) {
    if (command->store_tool_length)
        return true;
    switch (command->store) {
    case STORE_WCS:
        return command->store_wcs == machine->aside.job.interp.modal.wcs;
    case STORE_G92:
    case STORE_G92_ALONE:
        return true;
    default:
        return false;
    }
}

static bool reverses(const struct machine *machine, const struct gcode_command *command) {
    const enum gcode_spindle now = machine->outputs.spindle;
    return now != SPINDLE_OFF && command->spindle != SPINDLE_OFF && command->spindle != now;
}

/* Each of these waits in the look-ahead, which is the job's, or belongs to a program. */
static bool is_programs(const struct machine *machine, const struct gcode_command *command) {
    const struct gcode_modal *now = &machine->interp.gcode.modal;
    return command->flow != FLOW_RUN || command->tool_change || command->dwell_s >= 0.0f ||
           command->modes != MODES_KEEP || command->next.overrides != now->overrides ||
           command->next.feed_mode != FEED_PER_MIN || command->next.tool != now->tool ||
           (command->port >= 0 && command->port_kind >= PORT_DIGITAL_IN) || reverses(machine, command);
}

/* No 0xA3: it might be a line of the job. */
static bool is_unannounced(const struct machine *machine) {
    return machine->park.tool && rx_aside(&machine->lines.rx) == RX_ASIDE_NONE;
}

static bool switches(const struct machine *machine, const struct gcode_command *command) {
    const struct gcode_modal *now = &machine->interp.gcode.modal;
    return command->spindle != now->spindle || command->coolant != now->coolant || command->port >= 0;
}

enum status park_check(const struct machine *machine, const struct gcode_command *command) {
    if (is_programs(machine, command) || (is_unannounced(machine) && switches(machine, command)))
        return STATUS_PARKED;
    if (changes_offset(machine, command) && park_job_sets_offset(machine))
        return STATUS_PARKED_OFFSET;
    return check_move(machine, &command->move);
}

/* ---- out of it ---- */

void park_take_back(struct machine *machine, const double shift_mm[AXIS_COUNT]) {
    interp_take_back(&machine->interp, &machine->aside.job.interp, shift_mm);
    task_take_back(&machine->task, &machine->aside.job.task);
    lines_take_back(&machine->lines, &machine->aside.job.lines);
    machine->park = (struct machine_park){.open = false};
}

void park_forget(struct machine *machine) {
    static const double nowhere[AXIS_COUNT] = {0};
    dial_stop(machine);
    suspend_count_stop(&machine->suspend);
    if (machine->park.open) {
        if (machine->lines.open)
            answer_line(machine, STATUS_LOCKED);
        park_take_back(machine, nowhere);
        drive_take_position(machine);
    }
    machine->park = (struct machine_park){.open = false};
    tool_change_end(&machine->tool_change);
    rx_end_aside(&machine->lines.rx);
}

void park_end_lines(struct machine *machine) {
    rx_end_aside(&machine->lines.rx);
    if (machine->park.open)
        line_reader_reset(&machine->lines.reader);
}

void park_keep(struct machine *machine) {
    machine->park.resume_asked = false;
    park_end_lines(machine);
}

bool park_resume(struct machine *machine) {
    struct machine_park *park = &machine->park;
    if (machine->life.state == MACHINE_HOLD && (park->open || park->asked)) {
        park->resume_asked = true;
        return true;
    }
    if (park->asked && !park->tool) { /* behind a door: what it was to hold continues */
        park->asked = false;
        rx_end_aside(&machine->lines.rx);
    }
    return false;
}

void park_lose_sender(struct machine *machine) {
    struct machine_park *park = &machine->park;
    park_stop(machine);
    park->asked = park->tool && !park->open;
    park->silent = park->open;
    if (park->open)
        rx_close_aside(&machine->lines.rx);
    else
        rx_end_aside(&machine->lines.rx);
}
