/* SPDX-License-Identifier: MIT
 * The sender in control is gone. No one sees what moves, turns or burns, so a jog ends, a program is held
 * and its spindle and coolant stop, until someone else comes and resumes or resets. */
#include "machine/sender.h"

#include "machine/drive.h"
#include "machine/outputs.h"
#include "machine/park.h"
#include "machine/parts.h"
#include "machine/report.h"
#include "machine/reset.h"
#include "machine/suspend.h"

#include <stddef.h>

static bool is_anything_on(const struct machine *machine) {
    return machine->outputs.spindle != SPINDLE_OFF || machine->outputs.coolant != 0;
}

bool sender_has_lines(const struct machine *machine) {
    const uint8_t *bytes;
    return machine->task.stage != TASK_NONE || rx_peek(&machine->lines.rx, &bytes) > 0;
}

/* As 0x85 does: jogs that were sent and not yet read do not run. */
static void flush_jogs(struct machine *machine) {
    rx_request(&machine->lines.rx, REALTIME_JOG_CANCEL);
}

/* In an alarm no `~` will restore them. */
static void switch_off(struct machine *machine) {
    interp_know_spindle(machine, SPINDLE_OFF);
    interp_know_coolant(machine, 0);
    outputs_off(machine);
    report_changed_override(machine);
}

/* What would continue does not: it is held, or a reset ends it. */
static void hold(struct machine *machine) {
    if (machine->settings.sender_lost == LOST_JOB_STOPS) {
        sender_is_there(&machine->client);
        rx_request(&machine->lines.rx, REALTIME_RESET);
        return;
    }
    suspend_stop_restoring(&machine->suspend); /* behind the door: spindle and coolant stop again */
    if (machine->life.state == MACHINE_IDLE || machine->life.state == MACHINE_RUN)
        suspend_hold(machine);
    if (machine->life.state == MACHINE_RUN)
        return; /* the hold waits */
    (void)suspend_take_hold(&machine->suspend);
    machine->client.sender = SENDER_HELD;
    report_message(machine, sender_notice(machine));
}

/* The jog has ended, or there was none: what else would continue? */
static void settle(struct machine *machine) {
    if (is_anything_on(machine) || sender_has_lines(machine) ||
        machine->client.sender == SENDER_LOST_WITH_LINES) {
        hold(machine);
    } else {
        (void)suspend_take_hold(&machine->suspend);
        machine->client.sender = SENDER_THERE;
    }
}

/* What waits would home the machine, or unlock it and continue; no hold keeps it back. */
static void drop_lines(struct machine *machine) {
    report_message(machine, "Sender lost: queued lines discarded");
    reset_machine(machine, ALARM_NONE);
}

/* Nothing moves. A critical alarm refuses all that comes before a reset. */
static void leave_alarm(struct machine *machine) {
    bool lines = sender_has_lines(machine) || machine->client.sender == SENDER_LOST_WITH_LINES;
    machine->client.sender = SENDER_THERE;
    if (lines && !machine->life.critical && !machine->life.restart)
        drop_lines(machine);
    else if (is_anything_on(machine))
        switch_off(machine);
}

void sender_stop_homing(struct machine *machine) {
    machine->client.sender = SENDER_THERE;
    reset_machine(machine, ALARM_HOMING_RESET);
    machine->client.homing_lost = true;
}

/* A remote host has motion, or gets it as soon as the job has slowed down. */
static bool is_hosts(const struct machine *machine) {
    return machine->host.owns || machine->host.job.step == HOST_JOB_BRAKES;
}

void machine_sender_lost(struct machine *machine, bool lines_wait) {
    rx_withdraw(&machine->lines.rx); /* its own, not yet seen */
    park_lose_sender(machine);
    if (machine->client.sender == SENDER_HELD) {
        suspend_stop_restoring(&machine->suspend);
        return;
    }
    bool finishes = machine->settings.sender_lost == LOST_JOB_FINISHES;
    if (!finishes)
        machine->client.sender = lines_wait ? SENDER_LOST_WITH_LINES : SENDER_LOST;
    if (is_hosts(machine))
        return; /* it sees what moves; what the text side has left is held when it releases motion */
    flush_jogs(machine);
    if (machine->life.state == MACHINE_JOG)
        report_message(machine, "Sender lost: jog cancelled");
    (void)sender_lost_poll(machine); /* now: a `~` that comes next is someone else's */
}

void sender_lose_host(struct machine *machine, bool left) {
    const enum lost_job then = (enum lost_job)machine->settings.sender_lost;
    machine_host_gone(machine);
    if (!machine_host_has_segments(machine) || then == LOST_JOB_FINISHES)
        return;
    if (then == LOST_JOB_STOPS) {
        rx_request(&machine->lines.rx, REALTIME_RESET);
        return;
    }
    machine->client.host_held = !left;
    machine->client.host_hold = true;
    action_hold(machine);
    report_message(machine, "Remote host lost: feed hold");
}

void sender_lose_motion(struct machine *machine) {
    /* What a jog keeps out was refused to the host, and the jog goes where it was to go. */
    if (!is_hosts(machine) || machine->life.state == MACHINE_JOG)
        return;
    if (!machine->client.motion_lost)
        report_message(machine, "Remote host: motion was lost, feed hold");
    machine->client.motion_lost = true;
    if (machine->life.state != MACHINE_HOLD && machine->life.state != MACHINE_DOOR)
        action_hold(machine);
}

void sender_end_host_hold(struct machine *machine) {
    const bool waits = machine->client.sender != SENDER_THERE || sender_has_lines(machine) ||
                       machine_host_has_job(machine) || machine_host_has_segments(machine);
    if (machine->client.host_hold && !waits)
        (void)action_resume(machine);
}

const char *sender_notice(const struct machine *machine) {
    return machine->client.sender == SENDER_HELD ? "Sender lost: feed hold" : NULL;
}

/* A hold keeps the spindle; without anyone there it stops, too, after $75. A beam is dark at rest, and its
 * enable line follows immediately. */
static bool stop_outputs(struct machine *machine) {
    const struct machine_outputs *outputs = &machine->outputs;
    const struct settings *settings = &machine->settings;
    struct machine_client *client = &machine->client;
    if (machine->life.state != MACHINE_HOLD || outputs->suspended || machine->suspend.restores ||
        !drive_is_stopped(machine)) {
        client->outputs_waits = false;
        return false;
    }
    if (!client->outputs_waits) {
        const float wait_s = settings->laser_mode ? 0.0f : settings->sender_lost_spindle_s;
        client->outputs_waits = true;
        timer_start(machine, &client->outputs_time, (uint32_t)(wait_s * 1e6f));
    }
    bool stays_on = !settings->laser_mode && settings->sender_lost_spindle_s <= 0.0f;
    if (stays_on || timer_runs(machine, &client->outputs_time))
        return false;
    client->outputs_waits = false;
    outputs_suspend(&machine->outputs, true, outputs->coolant_waits);
    outputs_apply(machine);
    report_changed_override(machine);
    return true;
}

bool sender_lost_poll(struct machine *machine) {
    if (machine->client.host_held)
        return stop_outputs(machine);
    if (machine->client.sender == SENDER_THERE || is_hosts(machine))
        return false;
    if (machine->client.sender == SENDER_HELD)
        return stop_outputs(machine);
    switch (machine->life.state) {
    case MACHINE_JOG: /* realtime_poll() has cancelled it */
        return false;
    case MACHINE_RUN:
        if (machine->suspend.hold_waits)
            return false;
        hold(machine);
        break;
    case MACHINE_IDLE:
        settle(machine);
        break;
    case MACHINE_HOLD:
    case MACHINE_DOOR:
        hold(machine);
        break;
    case MACHINE_HOME:
        sender_stop_homing(machine);
        break;
    case MACHINE_ALARM:
        leave_alarm(machine);
        break;
    default: /* check mode and sleep do nothing that could continue, but check mode keeps what was on */
        machine->client.sender = SENDER_THERE;
        if (is_anything_on(machine))
            switch_off(machine);
        break;
    }
    return true;
}
