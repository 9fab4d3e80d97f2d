/* SPDX-License-Identifier: MIT
 * A network host interrupts a job of the text side, and releases motion.
 *
 *   job runs -> brakes along its path -> waits: the host moves -> released: a hold
 *        ^------ returns to where it was left <- outputs as they were <- ~ ----+
 *
 * Nothing of the job is lost: what was planned stays in the look-ahead, the current line stays as far as it
 * was, offsets and modes are no one else's. It continues from the exact step at which it was left. */
#include "machine/preempt.h"

#include "machine/drive.h"
#include "machine/host.h"
#include "machine/host_motion.h"
#include "machine/motor_current.h"
#include "machine/outputs.h"
#include "machine/parts.h"
#include "machine/report.h"
#include "machine/reset.h"
#include "machine/run_up.h"
#include "machine/state.h"
#include "machine/suspend.h"
#include "machine/timer.h"

#include "base/minmax.h"

#define LEG_MAX_S 1000.0f /* a longer way back is gone in several */

static bool goes(const struct machine *machine) {
    return machine->life.state == MACHINE_IDLE || machine->life.state == MACHINE_RUN;
}

/* Stages of which nothing is lost when motion pauses and returns. */
static bool can_pause(const struct machine *machine) {
    switch (machine->task.stage) {
    case TASK_THREAD:
    case TASK_PAUSED:
    case TASK_TOOL_WAIT:
    case TASK_JOG:
    case TASK_PROBE:
    case TASK_PROBING:
    case TASK_PROBED:
    case TASK_ALARMED:
    case TASK_SOFT_LIMIT:
    case TASK_HOMING:
    case TASK_LOCKED:
        return false;
    default:
        /* M66 waits for an input at this place, and the spindle comes to speed here; a tool in a thread
         * cannot leave it; and M53 P0 forbids holds. */
        return machine->task.awaits == AWAIT_NOTHING && !machine->spindle_sync.cutting &&
               (machine->interp.gcode.modal.overrides & OVERRIDE_HOLD) != 0;
    }
}

bool preempt_may(const struct machine *machine) {
    const struct machine_host *host = &machine->host;
    switch (host->job.step) {
    case HOST_JOB_NONE:
        return goes(machine) && !machine->life.restart && !machine->clock.quiet.on && can_pause(machine);
    case HOST_JOB_BRAKES:
        return true;
    case HOST_JOB_WAITS:
        return machine->life.state == MACHINE_HOLD && machine->client.sender != SENDER_HELD;
    case HOST_JOB_RESTORES:
    case HOST_JOB_RETURNS:
    default:
        return false;
    }
}

void preempt_begin(struct machine *machine) {
    struct machine_host *host = &machine->host;
    if (host->job.step == HOST_JOB_NONE) {
        host->job = (struct host_suspended){.step = HOST_JOB_BRAKES,
                                            .hold_asked = suspend_take_hold(&machine->suspend)};
        (void)state_go(machine, EVENT_HOLD);
        motion_hold(&machine->drive.motion);
    } else if (host->job.step == HOST_JOB_WAITS && !host->owns) {
        host->owns = true;
        host->end_known = false;
        /* The hold was only that of the release. One that the operator has asked for stays: the host's
         * motion then begins held. */
        if (host->job.by_release)
            (void)state_go(machine, EVENT_RESUME);
        report_message(machine, "Remote host controls motion: job paused");
    }
}

bool preempt_hold(struct machine *machine) {
    struct host_suspended *job = &machine->host.job;
    if (!WITH_HOST || job->step != HOST_JOB_BRAKES)
        return false;
    job->hold_asked = true;
    return true;
}

/* ---- to the host ---- */

static void keep_outputs(struct machine *machine) {
    struct host_suspended *job = &machine->host.job;
    const struct machine_outputs *outputs = &machine->outputs;
    const struct gcode_modal *modal = &machine->interp.gcode.modal;
    job->spindle = outputs->spindle;
    job->rpm = outputs->rpm;
    job->coolant = outputs->coolant;
    job->modal_spindle = modal->spindle;
    job->modal_rpm = modal->spindle_rpm;
    job->modal_coolant = modal->coolant;
    job->digital = machine->ports.digital;
    if (machine->settings.laser_mode && outputs->spindle != SPINDLE_OFF)
        outputs_set(machine, SPINDLE_OFF, 0.0f, outputs->coolant); /* the host's moves are no cuts */
}

/* Segments that waited: their travel is checked only now, because it was not known where the job would
 * stop. */
static void take_laid(struct machine *machine) {
    struct machine_host *host = &machine->host;
    if (host_take_segments(machine))
        return;
    host->late_refused = host->queue.head;
    host->late_refusals += host_queue_laid(&host->queue);
    machine_host_forget_ahead(machine);
}

/* The job is at rest: motion is the host's. */
static bool hand_over(struct machine *machine) {
    struct machine_host *host = &machine->host;
    struct host_suspended *job = &host->job;
    if (!drive_is_stopped(machine) || (machine->life.state != MACHINE_HOLD && !goes(machine)))
        return false;
    /* The state was Hold while the job slowed down; a host's motion runs in Idle or Run. */
    (void)state_go(machine, job->hold_asked ? EVENT_HOLD : EVENT_RESUME);
    /* Before any segment of the host: to this step the axes return. */
    machine_position(machine, job->left_steps);
    keep_outputs(machine);
    host->owns = true;
    host->end_known = false;
    if (motion_is_planned_out(&machine->drive.motion) &&
        machine->task.stage == TASK_NONE) { /* it ended just now */
        job->step = HOST_JOB_NONE;
        notes_forget(&machine->notes);
        motion_resume(&machine->drive.motion);
        report_message(machine, "Remote host controls motion");
    } else {
        job->step = HOST_JOB_WAITS;
        report_message(machine, "Remote host controls motion: job paused");
    }
    take_laid(machine);
    return true;
}

/* ---- and back ---- */

bool preempt_release(struct machine *machine) {
    struct machine_host *host = &machine->host;
    struct host_suspended *job = &host->job;
    bool quiet = host_queue_is_empty(&host->queue) && !host->probing && machine_is_standing(machine);
    if (!host->owns) /* as long as the job slows down, segments wait for it */
        return job->step != HOST_JOB_BRAKES;
    if (!quiet)
        return false;
    host->owns = false;
    job->by_release = state_go(machine, EVENT_HOLD);
    report_message(machine, "Remote host released motion: ~ resumes the job");
    return true;
}

void preempt_know_coolant(struct machine_host *host, uint8_t bits, uint8_t coolant) {
    struct host_suspended *job = &host->job;
    if (host->owns)
        return;
    job->coolant = (uint8_t)((job->coolant & ~bits) | (coolant & bits));
    job->modal_coolant = (uint8_t)((job->modal_coolant & ~bits) | (coolant & bits));
}

static void restore_outputs(struct machine *machine) {
    struct host_suspended *job = &machine->host.job;
    outputs_set(machine, job->spindle, job->rpm, job->coolant);
    interp_set_tools(&machine->interp, job->modal_spindle, job->modal_rpm, job->modal_coolant);
    motor_current_set_digital(machine, job->digital);
    run_up_return(machine, RUN_UP_DOOR_US);
    job->step = HOST_JOB_RESTORES;
}

void preempt_resume(struct machine *machine) {
    struct machine_host *host = &machine->host;
    if (!WITH_HOST || host->job.step == HOST_JOB_NONE)
        motion_resume(&machine->drive.motion);
    else if (host->job.step == HOST_JOB_BRAKES)
        host->job.hold_asked = false;
    else if (host->job.step == HOST_JOB_WAITS && !host->owns)
        restore_outputs(machine);
}

/* Steps back to where the job was left, at most what takes LEG_MAX_S. */
static int32_t way_back(const struct machine *machine, const int32_t position[AXIS_COUNT], unsigned axis) {
    float rate = machine->host.queue.limits.rate_steps_s[axis];
    /* 1e9 keeps the way within int32_t; + 1 so that a very slow axis comes nearer with each leg. */
    int64_t most = (int64_t)min_f(rate * LEG_MAX_S, 1e9f) + 1;
    int64_t way = (int64_t)machine->host.job.left_steps[axis] - position[axis];
    return (int32_t)(way > most ? most : way < -most ? -most : way);
}

/* The tool leaves the work before it moves sideways: up before the other axes, down after them.
 * @return false: it is there */
static bool next_leg(const struct machine *machine, int32_t steps[AXIS_COUNT]) {
    int32_t position[AXIS_COUNT];
    bool others = false;
    machine_position(machine, position);
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++) {
        steps[ax] = way_back(machine, position, ax);
        others |= ax != AXIS_Z && steps[ax] != 0;
    }
    if (steps[AXIS_Z] > 0) {
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            steps[ax] = ax == AXIS_Z ? steps[ax] : 0;
    } else if (others) {
        steps[AXIS_Z] = 0;
    }
    return others || steps[AXIS_Z] != 0;
}

/* A rapid by the host queue, which keeps the accelerations: the planner still has the look-ahead of the
 * job. */
static bool go_leg(struct machine *machine) {
    struct host_queue *queue = &machine->host.queue;
    struct host_queue_segment leg = {.flags = SEGMENT_RAPID | SEGMENT_LAST};
    float seconds = 0.0f;
    if (!next_leg(machine, leg.steps))
        return false;
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++) {
        float steps = (float)(leg.steps[ax] < 0 ? -leg.steps[ax] : leg.steps[ax]);
        seconds = max_f(seconds, steps / queue->limits.rate_steps_s[ax]);
    }
    leg.duration_us = (uint32_t)(1e6f * seconds * 100.0f / (float)machine->overrides.rapid_pct) + 1;
    if (host_queue_lay(queue, 0, &leg) == HOST_QUEUE_OK)
        host_queue_take(queue);
    return true;
}

bool preempt_poll(struct machine *machine) {
    struct host_suspended *job = &machine->host.job;
    if (job->step == HOST_JOB_NONE || job->step == HOST_JOB_WAITS)
        return false;
    if (job->step == HOST_JOB_BRAKES)
        return hand_over(machine);
    if (!goes(machine) || !host_queue_is_empty(&machine->host.queue) || !machine_is_standing(machine))
        return false;
    const enum run_up_state spindle = run_up_poll(machine);
    if (spindle == RUN_UP_WAITS)
        return false;
    if (spindle == RUN_UP_MISSED) {
        run_up_report_miss(machine);
        reset_alarm(machine, ALARM_SPINDLE);
        return true;
    }
    job->step = HOST_JOB_RETURNS;
    if (go_leg(machine))
        return true;
    job->step = HOST_JOB_NONE;
    motion_resume(&machine->drive.motion);
    return true;
}
