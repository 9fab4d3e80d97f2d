/* SPDX-License-Identifier: MIT
 * Real-time requests: report, reset, hold, door, overrides. They may stop, scale or flush; they start nothing
 * new.
 */
#include "machine/realtime.h"

#include "machine/actions.h"
#include "machine/auto_report.h"
#include "machine/jog.h"
#include "machine/outputs.h"
#include "machine/overrides.h"
#include "machine/park.h"
#include "machine/parking.h"
#include "machine/parts.h"
#include "machine/preempt.h"
#include "machine/report.h"
#include "machine/reset.h"
#include "machine/status.h"
#include "machine/suspend.h"

static void toggle_spindle_stop(struct machine *machine) {
    const struct machine_outputs *outputs = &machine->outputs;
    if (action_may(machine, ACTION_SPINDLE_KEY, ACTOR_TEXT) != REFUSAL_NONE ||
        outputs->spindle == SPINDLE_OFF || outputs->suspended)
        return;
    outputs_stop_spindle(&machine->outputs, !outputs->spindle_stopped);
    if (outputs->spindle_stopped) /* while it runs up: `~` is asked for again */
        suspend_stop_restoring(&machine->suspend);
    if (!outputs->spindle_stopped)
        report_message(machine, "Restoring spindle");
}

static void toggle_coolant(struct machine *machine, uint8_t bit) {
    if ((machine->interp.gcode.ports.no_coolant & bit) != 0) {
        report_message(machine, "This board has no output for that coolant");
        return;
    }
    if (action_may(machine, ACTION_COOLANT_KEY, ACTOR_TEXT) != REFUSAL_NONE)
        return;
    outputs_ask_coolant(&machine->outputs, machine->outputs.coolant ^ bit);
    interp_know_coolant(machine, machine->outputs.coolant);
    preempt_know_coolant(&machine->host, bit, machine->outputs.coolant);
}

static void take_override(struct machine *machine, int byte) {
    if (byte == 0x9E)
        toggle_spindle_stop(machine);
    else if (byte == 0xA0)
        toggle_coolant(machine, COOLANT_FLOOD);
    else if (byte == 0xA1)
        toggle_coolant(machine, COOLANT_MIST);
    else if (!overrides_take(&machine->overrides, byte))
        return;
    overrides_apply(machine);
    outputs_apply(machine);
    report_changed_override(machine);
}

/* A host that jogs has an end of its own for that. */
static void stop_hosts_jog(struct machine *machine) {
    host_stop_jog(&machine->host);
    if (machine->host.owns)
        machine_stopped_by_other(machine);
}

/* Several may have come since the last poll. Jogs that wait to be read are dropped first, then motion stops,
 * and `~` comes last: rx.c has kept it only if it came after the hold. */
static void take_bits(struct machine *machine, uint32_t bits) {
    if (machine->life.state == MACHINE_SLEEP) {
        rx_end_aside(&machine->lines.rx);
        return;
    }
    const bool jogs = machine->life.state == MACHINE_JOG || machine->park.open;
    if ((bits & REALTIME_JOG_CANCEL) != 0 || ((bits & REALTIME_HOLD) != 0 && jogs))
        lines_flush_jogs(&machine->lines);
    if ((bits & (REALTIME_JOG_CANCEL | REALTIME_HOLD)) != 0 && jogs && !machine->host.jog.on)
        lines_refuse_waiting(&machine->lines, machine->park.open);
    if ((bits & (REALTIME_JOG_CANCEL | REALTIME_HOLD)) != 0 && machine->life.state == MACHINE_JOG)
        stop_hosts_jog(machine);
    if ((bits & REALTIME_JOG_CANCEL) != 0 && machine->life.state == MACHINE_JOG)
        jog_cancel(machine);
    if ((bits & REALTIME_JOG_CANCEL) != 0) {
        park_stop(machine);
        suspend_stop_restoring(&machine->suspend);
    }
    if ((bits & REALTIME_DOOR) != 0)
        suspend_open_door(machine);
    if ((bits & REALTIME_HOLD) != 0)
        suspend_hold(machine);
    if ((bits & REALTIME_PARK) != 0)
        parking_ask(machine, (bits & REALTIME_RESUME) != 0);
    if ((bits & REALTIME_PARK_LOST) != 0)
        report_message(machine, "Not parked: send 0xA3 again");
    if ((bits & REALTIME_RESUME) != 0)
        suspend_end(machine);
}

/* Requests that wait: all until there is room, and as in Grbl `?` until homing is done. 0x87 is not Grbl's,
 * and a client that looks for a dead link needs an answer. */
static uint32_t reports_later(const struct machine *machine) {
    if (!text_has_room(&machine->out))
        return REALTIME_REPORTS;
    return machine->life.state == MACHINE_HOME ? REALTIME_STATUS : 0;
}

bool realtime_poll(struct machine *machine) {
    uint32_t bits = machine->lines.rx.realtime != 0 ? rx_take_realtime(&machine->lines.rx) : 0;
    if ((bits & REALTIME_RESET) != 0 || machine->life.reset_asked) {
        reset_machine(machine, ALARM_NONE);
        return true;
    }
    if ((bits & REALTIME_AUTO_REPORT) != 0)
        auto_report_toggle(machine);
    if (machine->life.critical) /* only a reset helps; a report is answered */
        bits &= REALTIME_REPORTS;
    const uint32_t later = bits & reports_later(machine);
    if (later != 0) {
        __atomic_fetch_or(&machine->lines.rx.realtime, later, __ATOMIC_RELEASE);
        bits &= ~later;
    }
    take_bits(machine, bits);
    bool any = bits != 0;
    for (int byte; (byte = rx_take_override(&machine->lines.rx)) >= 0; any = true)
        if (machine->life.state != MACHINE_SLEEP && !machine->life.critical)
            take_override(machine, byte);
    if ((bits & REALTIME_REPORTS) !=
        0) /* after what came with it: `!?` is answered by a machine that holds */
        status_report(machine, (bits & REALTIME_FULL_STATUS) != 0);
    return any;
}
