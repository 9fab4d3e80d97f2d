/* SPDX-License-Identifier: MIT
 * What a pendant next to the sender may rely on. */
#include "machine/pendant.h"

#include "machine/parts.h"
#include "machine/report.h"

enum machine_reads machine_reads(const struct machine *machine) {
    const enum machine_state state = machine->life.state;
    const bool aside = rx_aside(&machine->lines.rx) == RX_ASIDE_OPEN;
    if (machine->park.open)
        return aside && !machine->park.stops ? MACHINE_READS_OPERATORS : MACHINE_READS_NOTHING;
    if ((state != MACHINE_IDLE && state != MACHINE_ALARM) || machine->host.owns ||
        !machine_is_at_rest(machine))
        return MACHINE_READS_NOTHING;
    return machine_has_line(machine) ? MACHINE_READS_SOON : MACHINE_READS_LINES;
}

void machine_pendant_lost(struct machine *machine) {
    const bool jogs = machine->life.state == MACHINE_JOG;
    if (jogs || machine->park.open) {
        rx_request(&machine->lines.rx, REALTIME_JOG_CANCEL);
        if (jogs)
            report_message(machine, "Pendant lost: jog cancelled");
    } else if (machine_reads(machine) == MACHINE_READS_NOTHING) {
        machine_sender_lost(machine, false);
    }
}

void machine_set_mpg(struct machine *machine, bool on) {
    report_changed_mpg(&machine->reports, on);
}
