/* SPDX-License-Identifier: MIT
 * The sender that commands is gone. Nobody sees what moves, turns or burns, so a jog ends, a program is held
 * and its spindle and coolant stop, until somebody else comes and resumes or resets. */
#include "machine/inner.h"

static bool is_anything_on(const struct machine *machine) {
    return machine->outputs.spindle != SPINDLE_OFF || machine->outputs.coolant != 0;
}

static bool has_lines(const struct machine *machine) {
    const uint8_t *bytes;
    return machine->stage != TASK_NONE || rx_peek(&machine->rx, &bytes) > 0;
}

/* As 0x85 does: jogs that were sent and not yet read do not run. */
static void flush_jogs(struct machine *machine) {
    rx_request(&machine->rx, REALTIME_JOG_CANCEL);
}

/* In an alarm no `~` will restore them. */
static void switch_off(struct machine *machine) {
    struct gcode_modal *modal = &machine->gcode.modal;
    modal->spindle = machine->command.next.spindle = SPINDLE_OFF;
    modal->coolant = machine->command.next.coolant = 0;
    outputs_off(machine);
    report_changed_override(machine);
}

static void hold(struct machine *machine) {
    machine->restoring = false; /* behind the door: spindle and coolant stop again */
    if (machine->state == MACHINE_IDLE || machine->state == MACHINE_RUN)
        realtime_hold(machine);
    if (machine->state == MACHINE_RUN)
        return; /* the hold waits */
    machine->hold_waits = false;
    machine->sender = SENDER_HELD;
    report_message(machine, sender_notice(machine));
}

/* The jog has ended, or there was none: what else would go on? */
static void settle(struct machine *machine) {
    if (is_anything_on(machine) || has_lines(machine) || machine->sender == SENDER_LOST_WITH_LINES) {
        hold(machine);
    } else {
        machine->hold_waits = false;
        machine->sender = SENDER_THERE;
    }
}

/* What waits would home the machine, or unlock it and go on; no hold keeps it back. */
static void drop_lines(struct machine *machine) {
    report_message(machine, "Sender lost: waiting lines dropped");
    machine_reset(machine, ALARM_NONE);
}

/* Nothing moves. A critical alarm refuses all that comes before a reset. */
static void leave_alarm(struct machine *machine) {
    bool lines = has_lines(machine) || machine->sender == SENDER_LOST_WITH_LINES;
    machine->sender = SENDER_THERE;
    if (lines && !machine->critical && !machine->restart)
        drop_lines(machine);
    else if (is_anything_on(machine))
        switch_off(machine);
}

void sender_stop_homing(struct machine *machine) {
    machine->sender = SENDER_THERE;
    machine_reset(machine, ALARM_HOMING_RESET);
    machine->homing_lost = true;
}

/* A remote host has motion, or gets it as soon as the job has slowed down. */
static bool is_hosts(const struct machine *machine) {
    return machine->host.owns || machine->host.job.step == HOST_JOB_BRAKES;
}

void machine_sender_lost(struct machine *machine, bool lines_wait) {
    rx_withdraw(&machine->rx); /* its own, not yet seen */
    if (machine->sender == SENDER_HELD) {
        machine->restoring = false;
        return;
    }
    machine->sender = lines_wait ? SENDER_LOST_WITH_LINES : SENDER_LOST;
    if (is_hosts(machine))
        return; /* it sees what moves; what the text side has left is held when it gives motion back */
    flush_jogs(machine);
    if (machine->state == MACHINE_JOG)
        report_message(machine, "Sender lost: jog cancelled");
    (void)sender_lost_poll(machine); /* now: a `~` that comes next is somebody else's */
}

const char *sender_notice(const struct machine *machine) {
    return machine->sender == SENDER_HELD ? "Sender lost: feed hold" : NULL;
}

/* A hold keeps the spindle; without anybody there it stops, too. */
static bool stop_outputs(struct machine *machine) {
    struct machine_outputs *outputs = &machine->outputs;
    if (machine->state != MACHINE_HOLD || outputs->suspended || machine->restoring ||
        !machine_is_stopped(machine))
        return false;
    outputs->suspended = true;
    outputs_apply(machine);
    report_changed_override(machine);
    return true;
}

bool sender_lost_poll(struct machine *machine) {
    if (machine->sender == SENDER_THERE || is_hosts(machine))
        return false;
    if (machine->sender == SENDER_HELD)
        return stop_outputs(machine);
    switch (machine->state) {
    case MACHINE_JOG: /* realtime_poll() has cancelled it */
        return false;
    case MACHINE_RUN:
        if (machine->hold_waits)
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
    default: /* check mode and sleep do nothing that could go on, but check mode keeps what was on */
        machine->sender = SENDER_THERE;
        if (is_anything_on(machine))
            switch_off(machine);
        break;
    }
    return true;
}
