/* SPDX-License-Identifier: MIT
 * Hold and safety door, and resuming from them: spindle, coolant, motion. */
#include "machine/suspend.h"

#include "machine/drive.h"
#include "machine/inputs.h"
#include "machine/jog.h"
#include "machine/outputs.h"
#include "machine/overrides.h"
#include "machine/park.h"
#include "machine/parts.h"
#include "machine/preempt.h"
#include "machine/report.h"
#include "machine/reset.h"
#include "machine/retract.h"
#include "machine/run_up.h"
#include "machine/spindle_sync.h"
#include "machine/state.h"
#include "machine/timer.h"

#define COOLANT_START_US 1000000u /* Grbl's */

void suspend_hold(struct machine *machine) {
    park_stop(machine);
    if (preempt_hold(machine))
        return;
    if (machine->life.state == MACHINE_HOLD || machine->life.state == MACHINE_DOOR) {
        machine->suspend.restores =
            false; /* sender.c or door_poll() stops the tools again, and `~` is asked for again */
        sender_share_hold(&machine->client);
    }
    if (machine->life.state == MACHINE_JOG)
        jog_cancel(machine);
    else if (machine->life.state == MACHINE_RUN &&
             ((machine->interp.gcode.modal.overrides & OVERRIDE_HOLD) == 0 || spindle_sync_defers(machine)))
        /* Not possible here: M53 P0 is in force, or the tool is in a thread. suspend_release() does it
         * when it is. */
        machine->suspend.hold_waits = true;
    else if (state_go(machine, EVENT_HOLD))
        motion_hold(&machine->drive.motion);
}

void suspend_force_hold(struct machine *machine) {
    suspend_hold(machine);
    if (!machine->suspend.hold_waits || spindle_sync_defers(machine))
        return;
    machine->suspend.hold_waits = false;
    if (state_go(machine, EVENT_HOLD))
        motion_hold(&machine->drive.motion);
}

void suspend_release(struct machine *machine) {
    if (!machine->suspend.hold_waits || (machine->interp.gcode.modal.overrides & OVERRIDE_HOLD) == 0)
        return;
    machine->suspend.hold_waits = false;
    suspend_hold(machine);
}

void suspend_enable(struct machine *machine, uint8_t overrides) {
    interp_enable_overrides(&machine->interp, overrides);
    overrides_apply(machine);
    suspend_release(machine);
}

/* From hold or door back to what was. With anything under way it is a program that runs, from this moment on:
 * a line that waited must not find an idle machine in between. */
static void go_on(struct machine *machine) {
    sender_is_there(&machine->client);
    machine->suspend.tool = SUSPEND_WORKS;
    if (machine->park.open || machine->park.tool) { /* behind a door: the hold is the operator's as before */
        state_go(machine, EVENT_PARK);
        return;
    }
    state_go(machine, EVENT_RESUME);
    preempt_resume(machine);
    if (machine->task.stage != TASK_NONE || !machine_is_at_rest(machine))
        state_go(machine, EVENT_START);
}

/* However 0x9E has stopped the spindle, no motion comes back without it. */
static void end_spindle_stop(struct machine *machine) {
    if (!machine->outputs.spindle_stopped)
        return;
    outputs_stop_spindle(&machine->outputs, false);
    report_message(machine, "Restoring spindle");
}

/* A laser needs no time to run up, and shines only when the motion continues (outputs_poll()). */
static void restore_outputs(struct machine *machine) {
    end_spindle_stop(machine);
    outputs_suspend(&machine->outputs, false, true);
    machine->suspend.restores = true;
    outputs_apply(machine);
    run_up_return(machine, RUN_UP_DOOR_US);
}

/* Out of a plain hold, in which 0x9E may have stopped the spindle: without a setting Grbl does not wait. */
static void restore_spindle(struct machine *machine) {
    end_spindle_stop(machine);
    outputs_apply(machine);
    run_up_return(machine, 0);
    machine->suspend.restores = machine->outputs.coolant_waits || run_up_poll(machine) != RUN_UP_DONE;
    if (!machine->suspend.restores)
        go_on(machine);
}

void suspend_end(struct machine *machine) {
    /* `~` has three answers: to continue where nothing was switched off; to restore spindle and coolant
     * first; and none while the door is open or the tools are not off yet. With tools off in a plain hold
     * (the sender was lost) they are restored as after a door. */
    bool door = machine->life.state == MACHINE_DOOR, suspended = machine->outputs.suspended;
    if (park_resume(machine))
        return;
    machine->suspend.hold_waits = false;
    if ((!door && machine->life.state != MACHINE_HOLD) || machine->suspend.restores)
        return;
    if (!door && !suspended)
        restore_spindle(machine);
    else if (suspended && !(door && inputs_door_is_open(machine)))
        restore_outputs(machine);
}

void suspend_open_door(struct machine *machine) {
    bool jogs = machine->life.state == MACHINE_JOG;
    if (spindle_sync_defers(machine)) { /* a tap in its hole: the door counts when it is out */
        spindle_sync_keep_door(&machine->spindle_sync);
        return;
    }
    if (machine->life.state == MACHINE_HOME) {
        reset_machine(machine, ALARM_HOMING_DOOR);
        return;
    }
    if (machine->life.state == MACHINE_DOOR) { /* the tools go off again, and `~` is asked for again */
        machine->suspend.restores = false;
        park_stop(machine);
    }
    if (!state_go(machine, EVENT_OPEN))
        return;
    report_message(machine, "Check Door");
    machine->suspend.restores = false;
    park_stop(machine);
    if (jogs)
        jog_cancel(machine);
    else
        motion_hold(&machine->drive.motion);
}

/* Behind a closed door it is not less than Grbl's. */
static uint32_t coolant_start_us(const struct machine *machine) {
    const uint32_t delay_us = (uint32_t)(machine->settings.coolant_delay_s * 1e6f);
    return delay_us > COOLANT_START_US ? delay_us : COOLANT_START_US;
}

/* Spindle, then coolant, then the motion. @return true when it came further */
static bool restore_poll(struct machine *machine) {
    const struct machine_outputs *outputs = &machine->outputs;
    if (!machine->suspend.restores || timer_runs(machine, &machine->clock.timer))
        return false;
    const enum run_up_state spindle = run_up_poll(machine);
    if (spindle == RUN_UP_WAITS)
        return false;
    if (spindle == RUN_UP_MISSED) {
        run_up_report_miss(machine);
        reset_alarm(machine, ALARM_SPINDLE);
        return true;
    }
    if (outputs->coolant_waits) {
        outputs_suspend(&machine->outputs, false, false);
        outputs_apply(machine);
        timer_start(machine, &machine->clock.timer, outputs->coolant != 0 ? coolant_start_us(machine) : 0);
        return true;
    }
    machine->suspend.restores = false;
    go_on(machine);
    return true;
}

bool suspend_retracts(const struct machine *machine) {
    const enum machine_state state = machine->life.state;
    return machine->suspend.tool == SUSPEND_RETRACTS && (state == MACHINE_DOOR || state == MACHINE_HOLD);
}

/* Before that Z goes up, once ($42). @return true: tools are off now, or Z moves */
static bool switch_off(struct machine *machine) {
    const struct machine_outputs *outputs = &machine->outputs;
    machine->suspend.restores = false;
    const bool retracts = machine->suspend.tool == SUSPEND_WORKS && retract_begin(machine);
    machine->suspend.tool = retracts ? SUSPEND_RETRACTS : SUSPEND_PARKED;
    if (retracts)
        return true;
    outputs_suspend(&machine->outputs, true, outputs->coolant_waits);
    outputs_apply(machine);
    return true;
}

/* A feed hold that parks; M0, M6 and a parked hold leave the tool where it is. */
static bool hold_poll(struct machine *machine) {
    const bool waits = machine->task.stage == TASK_PAUSED || machine->task.stage == TASK_TOOL_WAIT;
    if (machine->settings.parking != RETRACT_IN_HOLD || waits || machine->park.asked || machine->park.open ||
        machine->outputs.suspended || machine->suspend.restores || !drive_is_stopped(machine) ||
        machine->host.owns)
        return false;
    return switch_off(machine);
}

/* Tools are switched off when motion has come to rest, not before: a cutter that stops in the material while
 * it moves breaks. If the door opens again while they are being restored, they go off again.
 * @return true when it came further */
static bool door_poll(struct machine *machine) {
    const struct machine_outputs *outputs = &machine->outputs;
    if (!drive_is_stopped(machine))
        return false;
    if (!outputs->suspended && (!machine->suspend.restores || inputs_door_is_open(machine))) {
        return switch_off(machine);
    }
    return restore_poll(machine);
}

bool suspend_poll(struct machine *machine) {
    bool any = machine->suspend.cancels && drive_is_stopped(machine);
    if (any)
        jog_end_cancel(machine);
    any |= jog_tell_stopped(machine);
    if (machine->life.state == MACHINE_DOOR)
        return door_poll(machine) || any;
    if (machine->life.state == MACHINE_HOLD)
        any |= restore_poll(machine) || hold_poll(machine);
    return any;
}
