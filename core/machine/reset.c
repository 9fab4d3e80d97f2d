/* SPDX-License-Identifier: MIT
 * Alarms, resets, and what is reported after them. */
#include "machine/reset.h"

#include "machine/auto_report.h"
#include "machine/drive.h"
#include "machine/faults.h"
#include "machine/inputs.h"
#include "machine/motors.h"
#include "machine/outputs.h"
#include "machine/overrides.h"
#include "machine/park.h"
#include "machine/parts.h"
#include "machine/report.h"
#include "machine/restart.h"
#include "machine/run_up.h"
#include "machine/spindle_sync.h"
#include "machine/square.h"
#include "machine/state.h"
#include "machine/stored.h"
#include "machine/timer.h"

#define QUIET_US 500000u /* after an alarm, as Grbl: senders get it before anything else */

enum way_out { OUT_BY_UNLOCK, OUT_BY_ACKNOWLEDGE, OUT_BY_RESET };

static bool is_critical(enum alarm alarm) {
    switch (alarm) {
#define ALARM(number, name, way_out, text)                                                                   \
    case ALARM_##name:                                                                                       \
        return OUT_BY_##way_out == OUT_BY_RESET;
#include "machine/alarms.def"
#undef ALARM
    case ALARM_NONE:
        break;
    }
    return false;
}

static void stop(struct machine *machine) {
    /* First, and all else after it: nothing below may take time while pulses still leave the pins. */
    drive_halt(machine);
    park_forget(machine);
    report_changed_offset(machine); /* with it comes which axes are trusted */
    suspend_cancel(&machine->suspend, false);
    sender_is_there(&machine->client);
    square_cut_off(machine);
    motors_release(machine);
    spindle_sync_forget(&machine->spindle_sync);
    run_up_forget(&machine->run_up);
    timer_start(machine, &machine->clock.timer, 0);
}

/* An alarm after which only a reset helps. The line under way gets its answer: as TASK_LOCKED, unless the
 * store answers it when it has been written, or the banner of a reset that has come before. */
static void stop_for_good(struct machine *machine) {
    machine->life.locks_again =
        machine->life.state == MACHINE_ALARM && (!machine->life.critical || machine->life.locks_again);
    stop(machine);
    outputs_off(machine);
    const bool answers = machine->lines.open && !machine->stored.answers && !machine->life.restart;
    task_enter(&machine->task, answers ? TASK_LOCKED : TASK_NONE);
    machine->life.critical = machine->life.critical_untold = true;
    machine->life.release_told = false;
    lines_run_startup(&machine->lines, false);
}

void reset_alarm(struct machine *machine, enum alarm alarm) {
    if (is_critical(alarm))
        stop_for_good(machine);
    machine->life.alarm = alarm;
    state_go(machine, EVENT_ALARM);
    report_alarm(machine, alarm);
    timer_start(machine, &machine->clock.quiet, QUIET_US);
}

static bool is_moving(const struct machine *machine) {
    return !machine_is_standing(machine) && machine->task.stage != TASK_DWELLING;
}

/* Whether motion is cut off is seen before stop() ends it; of a dwell, whose line may be that of a job to
 * which the axes return, by what stop() has counted. The banner waits (life.restart) until what is being
 * stored has been written: machine_poll(). */
void reset_machine(struct machine *machine, enum alarm alarm) {
    const bool homes = machine->life.state == MACHINE_HOME, moves = is_moving(machine);
    const uint8_t losses = machine->trust.losses;
    stop(machine);
    if (alarm == ALARM_NONE && homes)
        alarm = ALARM_HOMING_RESET;
    else if (alarm == ALARM_NONE && (moves || losses != machine->trust.losses))
        alarm = ALARM_RESET_IN_MOTION;
    probe_forget(&machine->probe);
    interp_forget(&machine->interp);
    outputs_off(machine);
    tool_change_forget(&machine->tool_change);
    overrides_begin(&machine->overrides);
    task_forget(&machine->task);
    lines_forget(&machine->lines);
    suspend_forget(&machine->suspend);
    report_forget_coolant(&machine->reports);
    auto_report_forget(&machine->auto_report);
    overrides_apply(machine);
    machine->life.critical = machine->life.critical_untold = false;
    machine->life.locks_again = machine->life.reset_asked = false;
    machine->life.restart = true;
    machine->life.alarm = ALARM_NONE;
    if (alarm != ALARM_NONE)
        reset_alarm(machine, alarm);
    else
        state_go(machine, EVENT_RESET);
}

/* All that came before the banner is gone, as in Grbl: also what came in the quiet after an alarm. */
void reset_restart(struct machine *machine) {
    if (lines_drop(&machine->lines)) /* as in Grbl: the line was taken after all */
        text_string(&machine->out, "ok\r\n");
    machine->life.restart = false;
    report_changed_offset(machine);
    report_changed_override(machine);
    report_banner(machine);
    if (machine->settings.hard_limits && inputs_limits(machine) != 0) {
        state_go(machine, EVENT_ALARM);
        report_message(machine, "Check Limits");
    }
    if (faults_any(machine)) {
        state_go(machine, EVENT_ALARM);
        faults_report(machine);
    }
    restart_report(machine);
    lines_run_startup(&machine->lines, machine->life.state != MACHINE_ALARM);
    if (stored_is_damaged(machine)) {
        machine->life.alarm = ALARM_STORE;
        stored_report(machine);
    } else if (machine->life.critical) { /* since the reset: it takes another one */
        machine->life.critical_untold = true;
    } else if (machine->life.state == MACHINE_ALARM) {
        report_message(machine, "'$H'|'$X' to unlock");
    }
    if (sender_take_homing_lost(&machine->client))
        report_message(machine, "Sender lost: homing stopped");
}

bool reset_is_barred(const struct machine *machine, const struct hal_inputs *inputs) {
    return inputs->estop && (machine->life.alarm == ALARM_ESTOP || machine->life.alarm == ALARM_LOCKED);
}

const char *reset_way_out(const struct machine *machine) {
    static const char *const locks[] = {
        [HAL_LOCK_NONE] = "Release the emergency stop",
        [HAL_LOCK_UPDATE] = "A firmware update is being written: wait until it ends",
        [HAL_LOCK_SAFE_MODE] = "Safe mode after crashes in a row: switch the controller off and on",
        [HAL_LOCK_STEPS_LOST] = "Step pulses were lost: restart the controller",
    };
    if (!reset_is_barred(machine, &machine->inputs))
        return "Reset to continue";
    if (machine->inputs.lock == HAL_LOCK_NONE && !machine->life.estop_was_released)
        return "E-stop open since start: close its contact, or see $749";
    return locks[machine->inputs.lock];
}

void reset_tell_way_out(struct machine *machine) {
    bool pressed = reset_is_barred(machine, &machine->inputs);
    if (!machine->life.critical_untold || (pressed && machine->life.release_told))
        return;
    machine->life.release_told = pressed;
    machine->life.critical_untold = pressed;
    report_message(machine, reset_way_out(machine));
}
