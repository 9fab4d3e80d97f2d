/* SPDX-License-Identifier: MIT
 * A network host interrupts a job of the text side, and releases motion; or the operator parks it (park.h).
 *
 *   job runs -> brakes along its path -> waits: the host moves -> released: a hold
 *        ^-- down at $57 <- outputs as they were <- up, to above where it was left <- ~
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

#include <string.h>

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
        return goes(machine) && machine->reports.mpg != MPG_IN_CONTROL && !machine->life.restart &&
               !machine->clock.quiet.on && can_pause(machine);
    case HOST_JOB_BRAKES:
        return true;
    case HOST_JOB_WAITS:
        return machine->life.state == MACHINE_HOLD && machine->client.sender != SENDER_HELD &&
               !machine->park.open;
    case HOST_JOB_LIFTS:
    case HOST_JOB_RESTORES:
    case HOST_JOB_LOWERS:
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
    if (job->step != HOST_JOB_BRAKES)
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

static int32_t greater(int32_t a, int32_t b) {
    return a > b ? a : b;
}

static void know_left(struct machine *machine) {
    struct host_suspended *job = &machine->host.job;
    machine_position(machine, job->left_steps);
    job->top_steps = job->left_steps[AXIS_Z];
}

/* Segments that waited: their travel is checked only now, because it was not known where the job would
 * stop. */
static void take_laid(struct machine *machine) {
    struct machine_host *host = &machine->host;
    if (host_take_segments(machine))
        return;
    host->late_refused = machine_host_taken(machine);
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
    know_left(machine);
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

void preempt_park(struct machine *machine) {
    struct machine_host *host = &machine->host;
    struct host_suspended *job = &host->job;
    const bool anew = job->step == HOST_JOB_NONE;
    if (anew) {
        *job = (struct host_suspended){.step = HOST_JOB_WAITS};
        know_left(machine);
        keep_outputs(machine);
    } else { /* a hold on the way back: what the job had is known, and may not be put out yet */
        host_stop_self(machine);
    }
    if (machine->settings.laser_mode && machine->outputs.spindle != SPINDLE_OFF)
        outputs_set(machine, SPINDLE_OFF, 0.0f, machine->outputs.coolant);
    job->step = HOST_JOB_WAITS;
    host->end_known = false;
}

void preempt_unpark(struct machine *machine, const int32_t left_steps[AXIS_COUNT], int32_t top_steps) {
    struct host_suspended *job = &machine->host.job;
    int32_t shift_steps[AXIS_COUNT], shifts = 0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        shift_steps[ax] = left_steps[ax] - job->left_steps[ax];
        shifts |= shift_steps[ax];
        job->left_steps[ax] = left_steps[ax];
    }
    job->top_steps = greater(greater(job->top_steps, top_steps), left_steps[AXIS_Z]);
    if (shifts != 0)
        drive_shift(machine, shift_steps);
}

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

void preempt_know_off(struct machine_host *host, const struct outputs_wish *to) {
    struct host_suspended *job = &host->job;
    const uint8_t off = (uint8_t)(to->coolant_mask & ~to->coolant);
    if (host->owns)
        return;
    if (to->turns && to->spindle == SPINDLE_OFF)
        job->spindle = job->modal_spindle = SPINDLE_OFF;
    job->coolant &= (uint8_t)~off;
    job->modal_coolant &= (uint8_t)~off;
}

static void restore_outputs(struct machine *machine) {
    const struct host_suspended *job = &machine->host.job;
    outputs_set(machine, job->spindle, job->rpm, job->coolant);
    interp_set_tools(&machine->interp, job->modal_spindle, job->modal_rpm, job->modal_coolant);
    motor_current_set_digital(machine, job->digital);
    run_up_return(machine, RUN_UP_DOOR_US);
}

void preempt_resume(struct machine *machine) {
    struct machine_host *host = &machine->host;
    if (host->job.step == HOST_JOB_NONE)
        motion_resume(&machine->drive.motion);
    else if (host->job.step == HOST_JOB_BRAKES)
        host->job.hold_asked = false;
    else if (host->job.step == HOST_JOB_WAITS && !host->owns)
        host->job.step = HOST_JOB_LIFTS;
}

/* Steps to a place, at most what takes LEG_MAX_S. */
static int32_t way_to(const struct machine *machine, int32_t from, int32_t to, unsigned axis) {
    float rate = machine->host.queue.limits.rate_steps_s[axis];
    /* 1e9 keeps the way within int32_t; + 1 so that a very slow axis comes nearer with each leg. */
    int64_t most = (int64_t)min_f(rate * LEG_MAX_S, 1e9f) + 1;
    int64_t way = (int64_t)to - from;
    return (int32_t)(way > most ? most : way < -most ? -most : way);
}

/* The tool leaves the work before it moves sideways: up, and only then the other axes.
 * @return false: it is above the place */
static bool lift_leg(const struct machine *machine, int32_t steps[AXIS_COUNT]) {
    const struct host_suspended *job = &machine->host.job;
    int32_t position[AXIS_COUNT];
    bool others = false;
    machine_position(machine, position);
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++) {
        steps[ax] = ax == AXIS_Z ? 0 : way_to(machine, position[ax], job->left_steps[ax], ax);
        others |= steps[ax] != 0;
    }
    const int32_t top = others ? job->top_steps : job->left_steps[AXIS_Z];
    if (position[AXIS_Z] >= top)
        return others;
    memset(steps, 0, AXIS_COUNT * sizeof *steps);
    steps[AXIS_Z] = way_to(machine, position[AXIS_Z], top, AXIS_Z);
    return true;
}

static bool lower_leg(const struct machine *machine, int32_t steps[AXIS_COUNT]) {
    int32_t position[AXIS_COUNT];
    machine_position(machine, position);
    steps[AXIS_Z] = way_to(machine, position[AXIS_Z], machine->host.job.left_steps[AXIS_Z], AXIS_Z);
    return steps[AXIS_Z] != 0;
}

/* As a rapid, and down at $57. */
static float leg_s(const struct machine *machine, const int32_t steps[AXIS_COUNT], bool lowers) {
    const struct host_queue *queue = &machine->host.queue;
    float seconds = 0.0f;
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++) {
        float count = (float)(steps[ax] < 0 ? -steps[ax] : steps[ax]);
        seconds = max_f(seconds, count / queue->limits.rate_steps_s[ax]);
    }
    seconds *= 100.0f / (float)machine->overrides.rapid_pct;
    if (!lowers)
        return seconds;
    const float way_mm = (float)-steps[AXIS_Z] / machine->drive.motion.plan.limits.steps_per_mm[AXIS_Z];
    return max_f(seconds, way_mm * 60.0f / machine->settings.return_feed_mm_min);
}

/* By the host queue, which keeps the accelerations: the planner still has the look-ahead of the job. */
static bool go_leg(struct machine *machine) {
    const bool lowers = machine->host.job.step == HOST_JOB_LOWERS;
    struct host_queue_segment leg = {.flags = SEGMENT_RAPID | SEGMENT_LAST};
    if (!(lowers ? lower_leg(machine, leg.steps) : lift_leg(machine, leg.steps)))
        return false;
    leg.duration_us = (uint32_t)(1e6f * leg_s(machine, leg.steps, lowers)) + 1;
    (void)host_move_self(machine, &leg); /* the queue is empty */
    return true;
}

/* The axes are at rest. */
static void next_step(struct machine *machine) {
    struct host_suspended *job = &machine->host.job;
    if (job->step == HOST_JOB_LIFTS && !go_leg(machine)) {
        restore_outputs(machine);
        job->step = HOST_JOB_RESTORES;
    } else if (job->step == HOST_JOB_LOWERS && !go_leg(machine)) {
        job->step = HOST_JOB_NONE;
        motion_resume(&machine->drive.motion);
    }
}

bool preempt_poll(struct machine *machine) {
    struct host_suspended *job = &machine->host.job;
    if (job->step == HOST_JOB_NONE || job->step == HOST_JOB_WAITS)
        return false;
    if (job->step == HOST_JOB_BRAKES)
        return hand_over(machine);
    if (!goes(machine) || !host_queue_is_empty(&machine->host.queue) || !machine_is_standing(machine))
        return false;
    const enum run_up_state spindle = job->step == HOST_JOB_LIFTS ? RUN_UP_DONE : run_up_poll(machine);
    if (spindle == RUN_UP_WAITS)
        return false;
    if (spindle == RUN_UP_MISSED) {
        run_up_report_miss(machine);
        reset_alarm(machine, ALARM_SPINDLE);
        return true;
    }
    if (job->step == HOST_JOB_RESTORES)
        job->step = HOST_JOB_LOWERS;
    next_step(machine);
    return true;
}
