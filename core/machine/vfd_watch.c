/* SPDX-License-Identifier: MIT
 * A spindle drive that does not answer. */
#include "machine/vfd_watch.h"

#include "machine/parts.h"
#include "machine/report.h"
#include "machine/trip.h"
#include "machine/vfd_spindle.h"

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

bool vfd_watch_poll(struct machine *machine) {
    struct machine_vfd *vfd = machine->board.vfd;
    if (!vfd_spindle_is_chosen(machine))
        return false;
    const bool told = tell(machine, vfd);
    if (!vfd->drive.tripped || !trip_may(machine)) {
        vfd->trip.on = false;
        return told;
    }
    return trip_poll(machine, &vfd->trip, ALARM_VFD) || told;
}
