/* SPDX-License-Identifier: MIT
 * Motion of a network host. Segments go by the host queue into the segment queue; jogs and homing use the
 * planner, so that they have its ramps and limits. */
#include "machine/host.h"

#include "machine/drive.h"
#include "machine/host_motion.h"
#include "machine/inputs.h"
#include "machine/jog.h"
#include "machine/overrides.h"
#include "machine/owner.h"
#include "machine/parts.h"
#include "machine/preempt.h"
#include "machine/report.h"
#include "machine/sender.h"
#include "machine/state.h"

#include "base/minmax.h"

#include <math.h>

#define JOG_LEAD_S    0.5f /* a jog is planned so far ahead, and the way to stop */
#define JOG_MIN_STEPS 4.0f

/* ---- who moves ---- */

bool machine_host_has_job(const struct machine *machine) {
    bool planned = machine->task.stage != TASK_NONE || !motion_is_planned_out(&machine->drive.motion);
    /* A host's own jogs and homing run in the planner, too, but are no job of the text side. */
    bool own = machine->host.jog.on || machine->host.jog.waits || machine->host.homing;
    return machine->host.job.step != HOST_JOB_NONE || (planned && !own && !machine->suspend.cancels);
}

bool machine_host_has_segments(const struct machine *machine) {
    return machine->host.owns &&
           (!host_queue_is_empty(&machine->host.queue) || machine->life.state == MACHINE_RUN);
}

bool machine_host_release(struct machine *machine) {
    struct machine_host *host = &machine->host;
    bool works = host->jog.on || host->jog.waits || host->homing || host->probing || machine->suspend.cancels;
    if (host->job.step != HOST_JOB_NONE)
        return preempt_release(machine);
    if (works)
        return false;
    if (!host->owns)
        return true;
    if (!machine_is_at_rest(machine))
        return false;
    drive_drop(machine); /* the planner continues from where the host is */
    host->owns = false;
    report_message(machine, "Remote host released motion");
    const bool stopped = host->jog_stopped;
    host->jog_stopped = false; /* what it does next is not stopped by this */
    if (stopped && sender_has_lines(machine)) {
        suspend_hold(machine);
        report_message(machine, "Stopped: the sender's lines wait for ~");
    }
    return true;
}

/* ---- segments ---- */

/* From rest it would be pushed on, once for each segment that comes before its host has heard of the contact.
 */
static bool is_pushed_on(const struct machine *machine, const struct host_queue_segment *segment) {
    struct hal_inputs inputs;
    if ((segment->flags & SEGMENT_PROBE) == 0 || !host_queue_is_empty(&machine->host.queue) ||
        !machine_is_standing(machine))
        return false;
    hal_inputs_read(machine->hal, &inputs);
    return inputs_probe(machine, &inputs, HAL_PROBE);
}

enum refusal machine_host_lay(struct machine *machine, uint32_t ahead,
                              const struct host_queue_segment *segment, uint32_t *number) {
    static const enum refusal refusals[] = {
        [HOST_QUEUE_OK] = REFUSAL_NONE,           [HOST_QUEUE_FULL] = REFUSAL_FULL,
        [HOST_QUEUE_NO_AXIS] = REFUSAL_AXIS,      [HOST_QUEUE_NO_TIMING] = REFUSAL_TIMING,
        [HOST_QUEUE_TOO_FAST] = REFUSAL_TOO_FAST,
    };
    struct host_queue *queue = &machine->host.queue;
    enum refusal refusal = action_may(machine, ACTION_SEGMENTS, ACTOR_HOST);
    bool preempts = refusal == REFUSAL_TEXT && preempt_may(machine);
    *number = machine_host_taken(machine) + ahead;
    /* A job of the text side is the one reason that can be overcome: it slows down, and the segment waits
     * until then. */
    if (refusal != REFUSAL_NONE && !preempts)
        return refusal;
    if (ahead == 0 && is_pushed_on(machine, segment))
        return REFUSAL_TOUCHES;
    struct host_queue_segment laid = *segment;
    if ((laid.flags & (SEGMENT_RAPID | SEGMENT_PROBE)) == 0)
        laid.flags |= SEGMENT_CUT; /* docs/protocol.md: a host marks what is not a cut */
    refusal = refusals[host_queue_lay(queue, ahead, &laid)];
    if (refusal != REFUSAL_NONE)
        return refusal;
    /* Only now that the segment is laid: one that is refused must not stop a job. */
    if (preempts)
        preempt_begin(machine);
    else if (!machine->host.owns)
        machine->host.end_known = false;
    /* While a job slows down it is not known where these segments begin: preempt.c takes them when it is
     * at rest. */
    bool taken = machine->host.job.step == HOST_JOB_BRAKES || host_take_segments(machine);
    /* Also when a later one has left the travel: those before it were taken, and move. */
    if (!preempts && (taken || !host_queue_is_empty(queue)))
        owner_take_over(machine);
    if (taken)
        return REFUSAL_NONE;
    *number = machine_host_taken(machine);
    /* What was laid beyond it would begin where the machine does not come. */
    host_queue_forget_ahead(queue);
    return REFUSAL_TRAVEL;
}

static axis_mask_t home_switches(const struct machine *machine) {
    unsigned own = machine->board.home_axes;
    unsigned homes = inputs_homing(machine, FIRST_MOTOR) | inputs_homing(machine, SECOND_MOTOR);
    return (axis_mask_t)((homes & own) | (inputs_limits(machine) & ~own));
}

static uint8_t low_bits(unsigned count) {
    return (uint8_t)((1u << count) - 1);
}

void machine_host_inputs(const struct machine *machine, struct host_inputs *inputs) {
    *inputs =
        (struct host_inputs){.limits = inputs_limits(machine),
                             .home = home_switches(machine),
                             .probe = inputs_probe(machine, &machine->inputs, HAL_PROBE),
                             .estop = machine->inputs.estop,
                             .digital = machine->inputs.digital & low_bits(machine->board.digital_inputs)};
}

uint8_t machine_host_digital(const struct machine *machine) {
    return machine->ports.digital & low_bits(machine->board.digital_outputs);
}

bool machine_host_spindle(const struct machine *machine, struct host_spindle *spindle) {
    const struct spindle *measured = &machine->drive.motion.emit.spindle;
    struct hal_encoder_state state;
    if (!WITH_ENCODER || !machine->interp.gcode.ports.encoder)
        return false;
    machine->board.encoder->read(machine->hal, &state);
    uint32_t now_us = hal_time_us(machine->hal);
    spindle->rpm = fabsf(spindle_rev_s(measured, now_us)) * 60.0f;
    spindle->turns = spindle_turns(measured, state.index_seen ? state.index_counts : 0, now_us);
    return true;
}

/* Contact, or the last of the segments that look for it is done. */
static bool follow_probe(struct machine *machine) {
    struct machine_host *host = &machine->host;
    struct host_queue *queue = &host->queue;
    bool hit = machine->drive.step.probe_hit;
    bool more = !host_queue_is_empty(queue) &&
                (queue->slots[queue->tail & (HOST_QUEUE_SIZE - 1)].flags & SEGMENT_PROBE) != 0;
    if (!host->probing || (hit ? !drive_is_stopped(machine) : more || !machine_is_standing(machine)))
        return false;
    if (hit)
        /* Before step_watch_probe(), which lets the step ISR keep the next contact. */
        step_probe_position(&machine->drive.step, host->probe_steps);
    else
        machine_position(machine, host->probe_steps);
    host->probe_contact = hit;
    host->probes_done++;
    host->probing = false;
    step_watch_probe(&machine->drive.step);
    if (hit)
        host_discard_queue(machine);
    return true;
}

void machine_host_discard(struct machine *machine) {
    struct machine_host *host = &machine->host;
    host->discards = host->owns || !host_queue_is_empty(&host->queue);
}

static bool follow_discard(struct machine *machine) {
    struct machine_host *host = &machine->host;
    if (!host->discards || !drive_is_stopped(machine))
        return false;
    host_discard_queue(machine);
    host->discards = false;
    return true;
}

static bool queue_on(struct machine *machine) {
    struct host_queue *queue = &machine->host.queue;
    /* In every other state a host's motion is held, so `!`, the door and buttons act on it as on a job. */
    bool goes = machine->life.state == MACHINE_IDLE || machine->life.state == MACHINE_RUN ||
                (machine->life.state == MACHINE_JOG && !machine->suspend.cancels) || /* of the dial */
                (machine->life.state == MACHINE_HOLD && machine->park.open && !machine->park.stops) ||
                suspend_retracts(machine);
    const enum task_stage stage = machine->task.stage;
    bool probes =
        machine->host.probing || (machine->park.open && (stage == TASK_PROBING || stage == TASK_TOOL_MOTION));
    host_queue_hold(queue, !goes || machine->host.discards || (probes && machine->drive.step.probe_hit));
    return hosted_poll(&machine->host.hosted);
}

/* ---- jog ---- */

/* The nearest place within the travel of a joint. Where X and Y of the tool are not those of the joints, they
 * have no travel of their own. */
static double in_travel(const struct machine *machine, unsigned axis, double mm) {
    const struct settings *settings = &machine->settings;
    double least_mm = -(double)settings->max_travel_mm[axis];
    bool mixed = settings->kinematics != KINEMATICS_CARTESIAN && axis <= AXIS_Y;
    if (!settings->soft_limits || mixed || least_mm >= 0.0)
        return mm;
    return mm > 0.0 ? 0.0 : mm < least_mm ? least_mm : mm;
}

/* The joints can be counted there; and where they are not the tool's axes, the tool is in its travel. */
static bool may_stand(const struct machine *machine, const double joints[AXIS_COUNT]) {
    int32_t steps[AXIS_COUNT] = {0};
    if (!motion_in_range(&machine->drive.motion, joints))
        return false;
    kinematics_target_steps(joints, machine->settings.steps_per_mm, machine->board.axis_count, steps);
    return machine->settings.kinematics == KINEMATICS_CARTESIAN || host_in_travel(machine, steps);
}

/* The end of the planned way moves on before the machine. The host's axes are joints. */
static bool extend_jog(struct machine *machine) {
    struct host_jog *jog = &machine->host.jog;
    const struct settings *settings = &machine->settings;
    int32_t position[AXIS_COUNT];
    float steps_per_mm = settings->steps_per_mm[jog->axis];
    /* v^2 / (2 a). With the lead, the end of the plan is always farther away than the way to a stop, so
     * that the jog keeps its speed. */
    float stop_mm = jog->speed_mm_s * jog->speed_mm_s / (2.0f * settings->acceleration_mm_s2[jog->axis]);
    double lead_mm = (double)max_f(stop_mm + jog->speed_mm_s * JOG_LEAD_S, JOG_MIN_STEPS / steps_per_mm);
    machine_position(machine, position);
    double at_mm = (double)position[jog->axis] / (double)steps_per_mm;
    if (jog->direction * (jog->target_mm - at_mm) > lead_mm || !motion_has_room(&machine->drive.motion))
        return false;
    struct motion_line line = {.feed_mm_s = jog->speed_mm_s, .flags = MOTION_FLAG_JOG};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        line.target_mm[ax] = machine->drive.motion.plan.position_mm[ax];
    double target_mm = in_travel(machine, jog->axis, jog->target_mm + jog->direction * lead_mm);
    line.target_mm[jog->axis] = target_mm;
    if (target_mm == jog->target_mm || !may_stand(machine, line.target_mm) ||
        !motion_line(&machine->drive.motion, &line, hal_time_us(machine->hal)))
        return false;
    motion_flush(&machine->drive.motion);
    jog->target_mm = target_mm;
    return true;
}

static void begin_jog(struct machine *machine) {
    struct host_jog *jog = &machine->host.jog;
    jog->waits = false;
    if (!state_go(machine, EVENT_JOG))
        return;
    drive_drop(machine); /* the planner continues from where the host is */
    machine->host.end_known = false;
    overrides_apply(machine);
    jog->on = true;
    machine->host.jog_stopped = false;
    jog->target_mm = machine->drive.motion.plan.position_mm[jog->axis];
    (void)extend_jog(machine);
}

enum refusal machine_host_jog(struct machine *machine, unsigned axis, int direction, uint32_t speed_steps_s) {
    struct machine_host *host = &machine->host;
    struct host_jog jog = {.axis = (uint8_t)axis, .direction = (int8_t)direction};
    if ((direction != 1 && direction != -1) || speed_steps_s == 0)
        return REFUSAL_MALFORMED;
    if (axis >= machine->board.axis_count)
        return REFUSAL_AXIS;
    if (jog_is_locked(machine))
        return REFUSAL_BUSY;
    float most_mm_s = machine->drive.motion.plan.limits.max_rate_mm_s[axis];
    jog.speed_mm_s = min_f((float)speed_steps_s / machine->settings.steps_per_mm[axis], most_mm_s);
    bool same =
        host->jog.axis == axis && host->jog.direction == direction && host->jog.speed_mm_s == jog.speed_mm_s;
    /* A repeated request: to cancel the jog and begin it again would stop the axis. */
    if (host->jog.on && same)
        return REFUSAL_NONE;
    /* action_may() would refuse it because of the jog that it replaces. */
    bool replaces = host->jog.on || host->jog.waits;
    enum refusal refusal = replaces ? REFUSAL_NONE : action_may(machine, ACTION_JOG, ACTOR_HOST);
    if (refusal != REFUSAL_NONE)
        return refusal;
    owner_take_over(machine);
    if (host->jog.on)
        jog_cancel(machine);
    host->jog = jog;
    host->jog.waits = true;
    return REFUSAL_NONE;
}

void machine_host_jog_stop(struct machine *machine) {
    struct host_jog *jog = &machine->host.jog;
    jog->waits = false;
    if (jog->on && machine->life.state == MACHINE_JOG && !machine->suspend.cancels)
        jog_cancel(machine);
}

void machine_host_gone(struct machine *machine) {
    machine_host_jog_stop(machine);
    if (machine->host.homing && machine->life.state == MACHINE_HOME)
        sender_stop_homing(machine);
}

static bool follow_jog(struct machine *machine) {
    struct host_jog *jog = &machine->host.jog;
    if (jog->on && (machine->life.state != MACHINE_JOG || machine->suspend.cancels))
        jog->on = false;
    if (jog->waits && machine->life.state == MACHINE_IDLE && machine_is_at_rest(machine)) {
        begin_jog(machine);
        return true;
    }
    return jog->on && extend_jog(machine);
}

/* ---- homing ---- */

static bool follow_homing(struct machine *machine) {
    struct machine_host *host = &machine->host;
    if (!host->homing || machine->task.stage == TASK_HOMING)
        return false;
    host->homing = false;
    lines_answer_homing(&machine->lines, false); /* no line waits for it */
    const axis_mask_t asked = machine->homing.asked;
    /* Success is both: homed, and no alarm since. */
    host->homed_ok =
        !machine->life.critical && !machine->life.restart && (machine->trust.axes & asked) == asked;
    return true;
}

bool host_poll(struct machine *machine) {
    /* The queue last: whether it is held depends on what the others have found. */
    bool any = preempt_poll(machine);
    if (WITH_HOST) {
        any |= follow_homing(machine);
        any |= follow_jog(machine);
        any |= follow_probe(machine);
        any |= follow_discard(machine);
    }
    return queue_on(machine) || any;
}
