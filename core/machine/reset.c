/* SPDX-License-Identifier: MIT
 * Alarms, resets, and what is said after them. */
#include "machine/inner.h"
#include "machine/square.h"

#define QUIET_US 500000u /* after an alarm, as Grbl: senders get it before anything else */

void machine_alarm(struct machine *machine, enum alarm alarm) {
    machine->alarm = alarm;
    machine_transition(machine, MACHINE_ALARMS);
    report_alarm(machine, alarm);
    machine_timer_start(machine, &machine->quiet, QUIET_US);
}

void machine_lock(struct machine *machine) {
    if (machine->settings.homing)
        machine_transition(machine, MACHINE_ALARMS);
}

static void stop(struct machine *machine) {
    machine_halt(machine);
    report_changed_offset(machine); /* with it comes which axes are trusted */
    machine->cancelling = false;
    machine->sender = SENDER_THERE;
    square_release(machine);
    thread_forget(machine);
    machine->timer.on = false;
}

void machine_alarm_critical(struct machine *machine, enum alarm alarm) {
    machine->locks_again = machine->state == MACHINE_ALARM && (!machine->critical || machine->locks_again);
    stop(machine);
    outputs_off(machine);
    machine->stage = machine->line_open && !machine->kept.answers ? TASK_LOCKED : TASK_NONE;
    machine->critical = machine->critical_untold = true;
    machine->release_told = false;
    machine->startup = STARTUP_LINE_COUNT;
    machine_alarm(machine, alarm);
}

static bool is_moving(const struct machine *machine) {
    return !machine_is_standing(machine) && machine->stage != TASK_DWELLING;
}

void machine_reset(struct machine *machine, enum alarm alarm) {
    if (alarm == ALARM_NONE && machine->state == MACHINE_HOME)
        alarm = ALARM_HOMING_RESET;
    else if (alarm == ALARM_NONE && is_moving(machine))
        alarm = ALARM_RESET_IN_MOTION;
    stop(machine);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        machine->gcode.offsets.g92_mm[ax] = machine->gcode.offsets.g92_kept_mm[ax] = 0.0;
        machine->probe_steps[ax] = 0;
    }
    machine->probe_ok = false;
    machine->gcode.offsets.tool_length_mm = 0.0;
    gcode_modal_init(&machine->gcode.modal);
    gcode_modes_forget(&machine->gcode);
    params_clear(&machine->params);
    outputs_off(machine);
    machine->feed_pct = machine->rapid_pct = machine->spindle_pct = 100;
    machine_apply_override(machine);
    machine->stage = TASK_NONE;
    machine->startup = STARTUP_LINE_COUNT;
    machine->arc_pending = machine->critical = machine->critical_untold = machine->flushing = false;
    machine->coolant_told = 0;
    machine->hold_waits = machine->input_awaited = false;
    machine->locks_again = false;
    machine->reset_asked = machine->homed_line = machine->restoring = false;
    machine->restart = true;
    machine->alarm = ALARM_NONE;
    if (alarm != ALARM_NONE)
        machine_alarm(machine, alarm);
    else
        machine_transition(machine, MACHINE_RESETS);
}

/* All that came before the banner is gone, as in Grbl: also what came in the quiet after an alarm. */
static void forget_input(struct machine *machine) {
    rx_flush(&machine->rx);
    machine->line_from = rx_taken(&machine->rx);
    line_reader_reset(&machine->reader);
}

void machine_restart(struct machine *machine) {
    forget_input(machine);
    if (machine->line_open && machine->source != LINE_STARTUP) /* as in Grbl: the line was taken after all */
        text_string(&machine->out, "ok\r\n");
    machine->line_open = machine->restart = false;
    machine->wco_wait = machine->ov_wait = 0;
    report_banner(machine);
    if (machine->settings.hard_limits && inputs_limits(machine) != 0) {
        machine_transition(machine, MACHINE_ALARMS);
        report_message(machine, "Check Limits");
    }
    machine->startup = machine->state == MACHINE_ALARM ? STARTUP_LINE_COUNT : 0;
    if (keep_is_damaged(machine)) {
        machine->alarm = ALARM_STORE;
        keep_report(machine);
    } else if (machine->state == MACHINE_ALARM) {
        report_message(machine, "'$H'|'$X' to unlock");
    }
    if (machine->homing_lost)
        report_message(machine, "Sender lost: homing stopped");
    machine->homing_lost = false;
}
