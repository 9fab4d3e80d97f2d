/* SPDX-License-Identifier: MIT
 * Real-time requests: report, reset, hold, door, overrides. They may stop, scale or flush; they start nothing
 * new.
 */
#include "machine/inner.h"

#define COOLANT_START_US 1000000u /* Grbl's, behind a closed door */

void realtime_hold(struct machine *machine) {
    if (preempt_hold(machine))
        return;
    if (machine->state == MACHINE_HOLD || machine->state == MACHINE_DOOR)
        machine->restoring =
            false; /* sender.c or door_poll() stops the tools again, and `~` is asked for again */
    if (machine->state == MACHINE_JOG)
        jog_cancel(machine);
    else if (machine->state == MACHINE_RUN &&
             ((machine->gcode.modal.overrides & OVERRIDE_HOLD) == 0 || thread_defers(machine)))
        machine->hold_waits = true;
    else if (machine_transition(machine, MACHINE_HOLDS))
        motion_hold(&machine->motion);
}

void realtime_release(struct machine *machine) {
    if (!machine->hold_waits || (machine->gcode.modal.overrides & OVERRIDE_HOLD) == 0)
        return;
    machine->hold_waits = false;
    realtime_hold(machine);
}

void realtime_enable(struct machine *machine, uint8_t overrides) {
    machine->gcode.modal.overrides = overrides;
    machine_apply_override(machine);
    realtime_release(machine);
}

/* From hold or door back to what was. With anything under way it is a program that runs, from this moment on:
 * a line that waited must not find an idle machine in between. */
static void go_on(struct machine *machine) {
    if (machine->outputs.spindle_stopped) {
        machine->outputs.spindle_stopped = false;
        report_message(machine, "Restoring spindle");
        outputs_apply(machine);
    }
    machine->sender = SENDER_THERE;
    machine_transition(machine, MACHINE_RESUMES);
    preempt_resume(machine);
    task_resume(machine);
    if (machine->stage != TASK_NONE || !machine_is_at_rest(machine))
        machine_transition(machine, MACHINE_STARTS);
}

/* A laser needs no time to run up, and shines only when the motion goes on (outputs_poll()). */
static void restore_outputs(struct machine *machine) {
    struct machine_outputs *outputs = &machine->outputs;
    bool runs_up = outputs->spindle != SPINDLE_OFF && !machine->settings.laser_mode;
    outputs->suspended = false;
    outputs->coolant_waits = true;
    machine->restoring = true;
    outputs_apply(machine);
    machine_timer_start(machine, &machine->timer, runs_up ? SPINDLE_RUN_UP_US : 0);
}

static void take_resume(struct machine *machine) {
    bool door = machine->state == MACHINE_DOOR, suspended = machine->outputs.suspended;
    machine->hold_waits = false;
    if ((!door && machine->state != MACHINE_HOLD) || machine->restoring)
        return;
    if (!door && !suspended)
        go_on(machine);
    else if (suspended && !(door && inputs_door_is_open(machine)))
        restore_outputs(machine);
}

void suspend_open_door(struct machine *machine) {
    bool jogs = machine->state == MACHINE_JOG;
    if (thread_defers(machine)) {
        machine->thread.door_waits = true;
        return;
    }
    if (machine->state == MACHINE_HOME) {
        machine_reset(machine, ALARM_HOMING_DOOR);
        return;
    }
    if (!machine_transition(machine, MACHINE_OPENS))
        return;
    report_message(machine, "Check Door");
    machine->restoring = false;
    if (jogs)
        jog_cancel(machine);
    else
        motion_hold(&machine->motion);
}

/* Spindle, then coolant, then the motion. @return true when it came further */
static bool restore_poll(struct machine *machine) {
    struct machine_outputs *outputs = &machine->outputs;
    if (!machine->restoring || machine_timer_runs(machine, &machine->timer))
        return false;
    if (outputs->coolant_waits) {
        outputs->coolant_waits = false;
        outputs_apply(machine);
        machine_timer_start(machine, &machine->timer, outputs->coolant != 0 ? COOLANT_START_US : 0);
        return true;
    }
    machine->restoring = false;
    go_on(machine);
    return true;
}

/* @return true when it came further */
static bool door_poll(struct machine *machine) {
    struct machine_outputs *outputs = &machine->outputs;
    if (!machine_is_stopped(machine))
        return false;
    if (!outputs->suspended && (!machine->restoring || inputs_door_is_open(machine))) {
        machine->restoring = false;
        outputs->suspended = true;
        outputs_apply(machine);
        return true;
    }
    return restore_poll(machine);
}

bool suspend_poll(struct machine *machine) {
    bool any = machine->cancelling && machine_is_stopped(machine);
    if (any)
        jog_end_cancel(machine);
    if (machine->state == MACHINE_DOOR)
        return door_poll(machine) || any;
    return (machine->state == MACHINE_HOLD && restore_poll(machine)) || any;
}

static uint8_t change(uint8_t percent, int by) {
    int value = by == 0 ? 100 : percent + by;
    return (uint8_t)(value < 10 ? 10 : value > 200 ? 200 : value);
}

static void toggle_spindle_stop(struct machine *machine) {
    struct machine_outputs *outputs = &machine->outputs;
    if (machine->state != MACHINE_HOLD || outputs->spindle == SPINDLE_OFF)
        return;
    outputs->spindle_stopped = !outputs->spindle_stopped;
    if (!outputs->spindle_stopped)
        report_message(machine, "Restoring spindle");
}

static void toggle_coolant(struct machine *machine, uint8_t bit) {
    enum machine_state state = machine->state;
    if ((machine->gcode.ports.no_coolant & bit) != 0) {
        report_message(machine, "This board has no output for that coolant");
        return;
    }
    if (state != MACHINE_IDLE && state != MACHINE_RUN && state != MACHINE_HOLD)
        return;
    machine->outputs.coolant ^= bit;
    machine->gcode.modal.coolant = machine->command.next.coolant = machine->outputs.coolant;
}

static void take_override(struct machine *machine, int byte) {
    static const int8_t by[] = {0, 10, -10, 1, -1};
    static const uint8_t rapid[] = {100, 50, 25};
    if (byte <= 0x94)
        machine->feed_pct = change(machine->feed_pct, by[byte - 0x90]);
    else if (byte <= 0x97)
        machine->rapid_pct = rapid[byte - 0x95];
    else if (byte >= 0x99 && byte <= 0x9D)
        machine->spindle_pct = change(machine->spindle_pct, by[byte - 0x99]);
    else if (byte == 0x9E)
        toggle_spindle_stop(machine);
    else if (byte == 0xA0)
        toggle_coolant(machine, COOLANT_FLOOD);
    else if (byte == 0xA1)
        toggle_coolant(machine, COOLANT_MIST);
    else
        return;
    machine_apply_override(machine);
    outputs_apply(machine);
    report_changed_override(machine);
}

static void take_bits(struct machine *machine, uint32_t bits) {
    if (machine->state == MACHINE_SLEEP)
        return;
    if ((bits & REALTIME_JOG_CANCEL) != 0 || ((bits & REALTIME_HOLD) != 0 && machine->state == MACHINE_JOG)) {
        machine->flush_until = rx_cancel_at(&machine->rx);
        machine->flushing = true;
    }
    if ((bits & REALTIME_JOG_CANCEL) != 0 && machine->state == MACHINE_JOG)
        jog_cancel(machine);
    if ((bits & REALTIME_DOOR) != 0)
        suspend_open_door(machine);
    if ((bits & REALTIME_HOLD) != 0)
        realtime_hold(machine);
    if ((bits & REALTIME_RESUME) != 0)
        take_resume(machine);
}

bool realtime_poll(struct machine *machine) {
    uint32_t bits = machine->rx.realtime != 0 ? rx_take_realtime(&machine->rx) : 0;
    if ((bits & REALTIME_RESET) != 0 || machine->reset_asked) {
        machine_reset(machine, ALARM_NONE);
        return true;
    }
    if (machine->critical)
        bits &= REALTIME_STATUS;
    bool later = machine->state == MACHINE_HOME || !text_has_room(&machine->out);
    if (later && (bits & REALTIME_STATUS) != 0) { /* answered when homing is done, or there is room */
        bits &= ~(uint32_t)REALTIME_STATUS;
        __atomic_fetch_or(&machine->rx.realtime, (uint32_t)REALTIME_STATUS, __ATOMIC_RELEASE);
    }
    take_bits(machine, bits);
    bool any = bits != 0;
    for (int byte; (byte = rx_take_override(&machine->rx)) >= 0; any = true)
        if (machine->state != MACHINE_SLEEP && !machine->critical)
            take_override(machine, byte);
    if ((bits & REALTIME_STATUS) != 0) /* after what came with it: `!?` is answered by a machine that holds */
        report_status(machine);
    return any;
}
