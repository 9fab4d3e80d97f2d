/* SPDX-License-Identifier: MIT
 * Motion of a network host. Segments go by the feed into the segment queue; jogs and homing use the planner,
 * so that they have its ramps and limits. */
#include "machine/host.h"

#include "machine/configure.h"
#include "machine/drive.h"
#include "machine/homing.h"
#include "machine/host_queue.h"
#include "machine/inputs.h"
#include "machine/jog.h"
#include "machine/keep.h"
#include "machine/keep_write.h"
#include "machine/outputs.h"
#include "machine/overrides.h"
#include "machine/parts.h"
#include "machine/preempt.h"
#include "machine/report.h"
#include "machine/reset.h"
#include "machine/sender.h"
#include "machine/state.h"
#include "machine/torque.h"

#include "base/minmax.h"

#include <math.h>

#define JOG_LEAD_S      0.5f /* a jog is planned so far ahead, and the way to stop */
#define JOG_LEAST_STEPS 4.0f

/* ---- who moves ---- */

static bool is_locked(const struct machine *machine) {
    return machine->life.critical || machine->life.restart || machine->life.state == MACHINE_ALARM ||
           machine->life.state == MACHINE_SLEEP;
}

/* Nothing of anybody is under way. Between two polls the state says whether something moves; asking the
 * motion side would also find it busy when it only looks around. */
static bool is_free(const struct machine *machine) {
    return machine->task.stage == TASK_NONE && feed_is_empty(&machine->host.feed) &&
           motion_is_planned_out(&machine->drive.motion) &&
           (machine->life.state == MACHINE_IDLE || machine->life.state == MACHINE_ALARM ||
            (machine->life.state == MACHINE_HOLD && machine_is_at_rest(machine)));
}

bool machine_host_is_busy(const struct machine *machine) {
    const struct machine_host *host = &machine->host;
    return machine->life.state == MACHINE_HOME || machine->suspend.cancels || host->jog.on ||
           host->jog.waits || host->discards;
}

/* Whether motion can be the host's: its own is under way, or nothing moves. */
static enum host_answer may_own(const struct machine *machine) {
    const struct machine_host *host = &machine->host;
    if (is_locked(machine))
        return HOST_LOCKED;
    if (machine_host_is_busy(machine))
        return HOST_BUSY;
    if (host->owns)
        return HOST_DONE;
    if (machine->client.sender == SENDER_HELD &&
        machine->life.state == MACHINE_HOLD) /* the next client must see it */
        return HOST_TEXT;
    if (machine->life.state == MACHINE_DOOR)
        return HOST_BUSY;
    return is_free(machine) ? HOST_DONE : HOST_TEXT;
}

/* Motion is the host's from now on. */
static void take_over(struct machine *machine) {
    if (machine->host.owns)
        return;
    machine->host.owns = true;
    notes_forget(&machine->notes);
    report_message(machine, "Remote host controls motion");
}

bool machine_host_has_job(const struct machine *machine) {
    bool planned = machine->task.stage != TASK_NONE || !motion_is_planned_out(&machine->drive.motion);
    bool own = machine->host.jog.on || machine->host.jog.waits || machine->host.homing;
    return machine->host.job.step != HOST_JOB_NONE || (planned && !own && !machine->suspend.cancels);
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
    drive_drop(machine); /* the planner goes on from where the host stands */
    host->owns = false;
    report_message(machine, "Remote host released motion");
    return true;
}

/* ---- segments ---- */

/* From rest it would be pushed on, once for each segment that comes before its host has heard of the contact.
 */
static bool is_pushed_on(const struct machine *machine, const struct feed_segment *segment) {
    struct hal_inputs inputs;
    if ((segment->flags & SEGMENT_PROBE) == 0 || !feed_is_empty(&machine->host.feed) ||
        !machine_is_standing(machine))
        return false;
    hal_inputs_read(machine->hal, &inputs);
    return inputs_probe(machine, &inputs);
}

enum host_answer machine_host_lay(struct machine *machine, uint32_t ahead, const struct feed_segment *segment,
                                  uint32_t *number) {
    static const enum host_answer answers[] = {
        [FEED_OK] = HOST_DONE,           [FEED_FULL] = HOST_FULL,
        [FEED_NO_AXIS] = HOST_NO_AXIS,   [FEED_NO_TIMING] = HOST_NO_TIMING,
        [FEED_TOO_FAST] = HOST_TOO_FAST,
    };
    struct feed *feed = &machine->host.feed;
    enum host_answer answer = may_own(machine);
    bool preempts = answer == HOST_TEXT && preempt_may(machine);
    *number = feed->head + ahead;
    if (answer != HOST_DONE && !preempts)
        return answer;
    if (ahead == 0 && is_pushed_on(machine, segment))
        return HOST_TOUCHES;
    struct feed_segment laid = *segment;
    if ((laid.flags & (SEGMENT_RAPID | SEGMENT_PROBE)) == 0)
        laid.flags |= SEGMENT_CUT; /* docs/protocol.md: a host marks what is no cut */
    answer = answers[feed_lay(feed, ahead, &laid)];
    if (answer != HOST_DONE)
        return answer;
    if (preempts)
        preempt_begin(machine);
    else if (!machine->host.owns)
        machine->host.end_known = false;
    bool taken = machine->host.job.step == HOST_JOB_BRAKES || host_take_segments(machine);
    if (!preempts && (taken || !feed_is_empty(feed)))
        take_over(machine);
    if (taken)
        return HOST_DONE;
    *number = feed->head;
    feed_forget_ahead(feed);
    return HOST_OUT_OF_TRAVEL;
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
                             .probe = inputs_probe(machine, &machine->inputs),
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
    struct feed *feed = &host->feed;
    bool hit = machine->drive.step.probe_hit;
    bool more =
        !feed_is_empty(feed) && (feed->slots[feed->tail & (FEED_SIZE - 1)].flags & SEGMENT_PROBE) != 0;
    if (!host->probing || (hit ? !drive_is_stopped(machine) : more || !machine_is_standing(machine)))
        return false;
    if (hit)
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
    host->discards = host->owns || !feed_is_empty(&host->feed);
}

static bool follow_discard(struct machine *machine) {
    struct machine_host *host = &machine->host;
    if (!host->discards || !drive_is_stopped(machine))
        return false;
    host_discard_queue(machine);
    host->discards = false;
    return true;
}

static bool feed_on(struct machine *machine) {
    struct feed *feed = &machine->host.feed;
    bool goes = machine->life.state == MACHINE_IDLE || machine->life.state == MACHINE_RUN;
    feed_hold(feed,
              !goes || machine->host.discards || (machine->host.probing && machine->drive.step.probe_hit));
    return feed_poll(feed);
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
    float stop_mm = jog->speed_mm_s * jog->speed_mm_s / (2.0f * settings->acceleration_mm_s2[jog->axis]);
    double lead_mm = (double)most_f(stop_mm + jog->speed_mm_s * JOG_LEAD_S, JOG_LEAST_STEPS / steps_per_mm);
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
    if (!state_go(machine, MACHINE_JOGS))
        return;
    drive_drop(machine); /* the planner goes on from where the host stands */
    machine->host.end_known = false;
    overrides_apply(machine);
    jog->on = true;
    jog->target_mm = machine->drive.motion.plan.position_mm[jog->axis];
    (void)extend_jog(machine);
}

enum host_answer machine_host_jog(struct machine *machine, unsigned axis, int direction,
                                  uint32_t speed_steps_s) {
    struct machine_host *host = &machine->host;
    struct host_jog jog = {.axis = (uint8_t)axis, .direction = (int8_t)direction};
    if ((direction != 1 && direction != -1) || speed_steps_s == 0)
        return HOST_MALFORMED;
    if (axis >= machine->board.axis_count)
        return HOST_NO_AXIS;
    float most_mm_s = machine->drive.motion.plan.limits.max_rate_mm_s[axis];
    jog.speed_mm_s = least_f((float)speed_steps_s / machine->settings.steps_per_mm[axis], most_mm_s);
    bool same =
        host->jog.axis == axis && host->jog.direction == direction && host->jog.speed_mm_s == jog.speed_mm_s;
    if (host->jog.on && same)
        return HOST_DONE;
    bool replaces = host->jog.on || host->jog.waits;
    enum host_answer answer = replaces ? HOST_DONE : may_own(machine);
    if (answer != HOST_DONE)
        return answer;
    if (!replaces && (machine->life.state != MACHINE_IDLE || !is_free(machine)))
        return HOST_BUSY;
    take_over(machine);
    if (host->jog.on)
        jog_cancel(machine);
    host->jog = jog;
    host->jog.waits = true;
    return HOST_DONE;
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

/* ---- homing, stops, outputs, settings ---- */

enum host_answer machine_host_home(struct machine *machine, axis_mask_t axes) {
    struct machine_host *host = &machine->host;
    char letters[AXIS_COUNT + 1];
    unsigned count = 0;
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++)
        if ((axes >> ax & 1) != 0 && machine->settings.max_travel_mm[ax] > 0.0f)
            letters[count++] = AXIS_LETTERS[ax];
    letters[count] = '\0';
    if (!machine->settings.homing || count == 0)
        return HOST_NO_HOMING;
    if (machine->life.critical || machine->life.restart || machine->life.state == MACHINE_SLEEP ||
        keep_is_damaged(machine))
        return HOST_LOCKED;
    enum host_answer answer = machine->life.state == MACHINE_ALARM ? HOST_DONE : may_own(machine);
    if (answer != HOST_DONE)
        return answer;
    if (!is_free(machine) || machine->life.state == MACHINE_HOLD || inputs_door_is_open(machine))
        return HOST_BUSY;
    drive_drop(machine); /* the planner goes on from where the host stands */
    if (homing_begin(machine, letters) != STATUS_OK)
        return HOST_NO_HOMING;
    take_over(machine);
    host->homing = true;
    host->homed_ok = host->end_known = false;
    return HOST_DONE;
}

static bool follow_homing(struct machine *machine) {
    struct machine_host *host = &machine->host;
    if (!host->homing || machine->task.stage == TASK_HOMING)
        return false;
    host->homing = false;
    lines_answer_homing(&machine->lines, false); /* no line waits for it */
    const axis_mask_t asked = machine->homing.asked;
    host->homed_ok =
        !machine->life.critical && !machine->life.restart && (machine->trust.axes & asked) == asked;
    return true;
}

void machine_host_estop(struct machine *machine) {
    if (!machine->life.critical)
        reset_alarm(machine, ALARM_ESTOP);
}

void machine_host_hold(struct machine *machine) {
    rx_request(&machine->lines.rx, REALTIME_HOLD);
}

void machine_host_resume(struct machine *machine) {
    rx_request(&machine->lines.rx, REALTIME_RESUME);
}

bool machine_host_unlock(struct machine *machine) {
    bool sleeps = machine->life.state == MACHINE_SLEEP; /* motors without current may have moved */
    if (!machine->life.critical && machine->life.state != MACHINE_ALARM && !sleeps)
        return false;
    if (keep_is_damaged(machine))
        return false;
    bool stays_locked = machine->life.locks_again || sleeps;
    reset_machine(machine, ALARM_NONE);
    timer_end_quiet(&machine->clock);
    if (!stays_locked)
        (void)state_go(machine, MACHINE_UNLOCKS);
    return true;
}

static void set_coolant(struct machine *machine, uint8_t coolant) {
    if (machine->outputs.coolant == coolant)
        return;
    outputs_ask_coolant(&machine->outputs, coolant);
    outputs_apply(machine);
    report_changed_override(machine);
}

static void know_outputs(struct gcode_modal *modal, const struct host_outputs *to, uint8_t coolant) {
    modal->coolant = coolant;
    if (!to->turns)
        return;
    modal->spindle = to->spindle;
    modal->spindle_rpm = to->rpm;
}

/* Coolant that the board lacks is asked for, and $91 does not pass it. */
static bool lacks_coolant(const struct machine *machine, const struct host_outputs *to) {
    const struct gcode_ports *ports = &machine->interp.gcode.ports;
    return !ports->coolant_passes && (to->coolant & to->coolant_mask & ports->no_coolant) != 0;
}

/* The spindle can do what is asked for on this board. */
static bool can_turn(const struct machine *machine, const struct host_outputs *to) {
    const struct gcode_ports *ports = &machine->interp.gcode.ports;
    if (!to->turns || to->spindle == SPINDLE_OFF)
        return true;
    return !ports->no_spindle && (!ports->no_reverse || to->spindle == SPINDLE_CW);
}

enum host_answer machine_host_outputs(struct machine *machine, const struct host_outputs *to) {
    uint8_t coolant =
        (uint8_t)((machine->outputs.coolant & ~to->coolant_mask) | (to->coolant & to->coolant_mask));
    coolant &= (uint8_t)~machine->interp.gcode.ports.no_coolant; /* the status shows what is on */
    bool starts = (to->turns && to->spindle != SPINDLE_OFF) || (to->coolant & to->coolant_mask) != 0;
    if (!can_turn(machine, to) || lacks_coolant(machine, to))
        return HOST_NO_OUTPUT;
    if (is_locked(machine) && starts)
        return HOST_LOCKED;
    if (!machine->host.owns && starts &&
        (machine->task.stage != TASK_NONE || machine->life.state != MACHINE_IDLE))
        return HOST_TEXT;
    know_outputs(&machine->interp.gcode.modal, to, coolant);
    if (!machine->host.owns) /* the line under way; that of a job that waits is not concerned */
        know_outputs(&machine->task.command.next, to, coolant);
    if (to->turns)
        outputs_set(machine, to->spindle, to->rpm, coolant);
    else
        set_coolant(machine, coolant);
    torque_set_digital(machine,
                       (machine->ports.digital & ~to->digital_mask) | (to->digital & to->digital_mask));
    return HOST_DONE;
}

enum status machine_host_set(struct machine *machine, uint16_t number, double value) {
    if (!is_free(machine) || machine->life.state == MACHINE_HOLD)
        return STATUS_NOT_IDLE;
    if (machine->life.critical)
        return STATUS_LOCKED;
    if (keep_is_damaged(machine))
        return STATUS_STORE_DAMAGED;
    return configure_set(machine, number, value);
}

bool machine_host_save(struct machine *machine) {
    return keep_save(machine, KEEP_BIT(KEEP_SETTINGS));
}

bool host_poll(struct machine *machine) {
    if (!WITH_HOST)
        return false;
    bool any = preempt_poll(machine);
    any |= follow_homing(machine);
    any |= follow_jog(machine);
    any |= follow_probe(machine);
    any |= follow_discard(machine);
    return feed_on(machine) || any;
}
