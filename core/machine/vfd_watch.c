/* SPDX-License-Identifier: MIT
 * A spindle drive that does not answer. */
#include "machine/vfd_watch.h"

#include "machine/drive.h"
#include "machine/jog.h"
#include "machine/parts.h"
#include "machine/report.h"
#include "machine/reset.h"
#include "machine/suspend.h"
#include "machine/timer.h"
#include "machine/vfd_spindle.h"

/* A feed hold takes less, unless the tool is in a thread. Then the alarm ends motion without a ramp. */
#define STOP_US 10000000u

/* What to look at, by what was received. */
static void report_cause(const struct machine *machine, const struct vfd *drive) {
    static const char *const causes[] = {
        [VFD_FAULT_NONE] = "",
        [VFD_FAULT_SILENT] = "no answer. Check power, A and B, $460, $374, $681 and its RS-485 settings",
        [VFD_FAULT_GARBLED] =
            "garbled answers. Check termination, GND, $374, and for two devices with this address",
        [VFD_FAULT_OTHER] = "it answers something else, or too late. Check $395, and raise $375",
        [VFD_FAULT_REFUSED] = "it refuses a request. Check $395, and that RS-485 may command it; reason ",
        [VFD_FAULT_ECHO] = "the bus returns what is sent. Connect RE of the transceiver with DE",
    };
    text_string(&machine->out, causes[drive->fault]);
    if (drive->fault == VFD_FAULT_REFUSED)
        text_int(&machine->out, drive->refusal);
}

static void report_lost(const struct machine *machine, const struct vfd *drive) {
    text_string(&machine->out, "[MSG:Spindle drive ");
    text_int(&machine->out, drive->config.address);
    text_string(&machine->out, ": ");
    report_cause(machine, drive);
    text_string(&machine->out, "]\r\n");
}

static bool tell(struct machine *machine, struct machine_vfd *vfd) {
    const struct vfd *drive = &vfd->drive;
    if (!vfd->lost_told && drive->link == VFD_LOST) {
        vfd->lost_told = true;
        report_lost(machine, drive);
        return true;
    }
    if (vfd->lost_told && drive->link == VFD_UP && drive->run_confirmed) {
        vfd->lost_told = false;
        report_message(machine, drive->direction == 0 ? "Spindle drive answers again: stopped"
                                                      : "Spindle drive answers again");
        return true;
    }
    return false;
}

/* In an alarm and asleep nothing moves, and the spindle is off already as far as the controller can. */
static bool may_alarm(const struct machine *machine) {
    return machine->life.state != MACHINE_ALARM && machine->life.state != MACHINE_SLEEP &&
           !machine->life.restart;
}

/* `~` does not resume meanwhile, and a jog that follows does not begin. */
static void stop_motion(struct machine *machine) {
    const enum machine_state state = machine->life.state;
    if (state == MACHINE_RUN || state == MACHINE_IDLE)
        suspend_force_hold(machine);
    else if (state == MACHINE_JOG && !machine->suspend.cancels)
        jog_cancel(machine);
    else if (machine->park.open)
        park_stop(machine);
}

static bool is_stopped(const struct machine *machine) {
    return machine->life.state == MACHINE_HOME || (drive_is_stopped(machine) && !machine->suspend.cancels);
}

bool vfd_watch_poll(struct machine *machine) {
    struct machine_vfd *vfd = machine->board.vfd;
    if (!vfd_spindle_is_chosen(machine))
        return false;
    const bool told = tell(machine, vfd);
    if (!vfd->drive.tripped || !may_alarm(machine)) {
        vfd->stops = false;
        return told;
    }
    if (!vfd->stops)
        timer_start(machine, &vfd->limit, STOP_US);
    vfd->stops = true;
    if (!is_stopped(machine) && timer_runs(machine, &vfd->limit)) {
        stop_motion(machine);
        return told;
    }
    vfd->stops = false;
    reset_alarm(machine, ALARM_VFD);
    return true;
}
