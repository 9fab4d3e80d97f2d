/* SPDX-License-Identifier: MIT
 * What a pendant next to the sender may rely on. */
#include "machine/pendant.h"

#include "machine/parts.h"
#include "machine/report.h"
#include "machine/tool_change.h"

/* The operator's lines are answered before those of the job: one of these that is not makes others wait. */
static enum machine_reads reads_parked(const struct machine *machine) {
    const uint8_t *bytes;
    const bool held = machine->life.state == MACHINE_HOLD; /* behind a door nothing is read, nor later */
    if (!held || rx_aside(&machine->lines.rx) != RX_ASIDE_OPEN || machine->park.stops)
        return MACHINE_READS_NOTHING;
    const bool waits = machine_has_line(machine) || rx_peek_aside(&machine->lines.rx, &bytes) > 0;
    return waits ? MACHINE_READS_SOON : MACHINE_READS_OPERATORS;
}

/* Check mode moves nothing: a pendant that has begun it must be able to end it. */
static bool is_free(const struct machine *machine) {
    const enum machine_state state = machine->life.state;
    return (state == MACHINE_IDLE || state == MACHINE_ALARM || state == MACHINE_CHECK) &&
           !machine->host.owns && machine_is_at_rest(machine);
}

enum machine_reads machine_reads(const struct machine *machine) {
    if (machine->park.open)
        return reads_parked(machine);
    if (!is_free(machine))
        return MACHINE_READS_NOTHING;
    return machine_has_line(machine) ? MACHINE_READS_SOON : MACHINE_READS_LINES;
}

enum machine_whose machine_whose(const struct machine *machine) {
    if (rx_aside(&machine->lines.rx) != RX_ASIDE_OPEN)
        return tool_change_goes(machine) ? MACHINE_WHOSE_TOOL : MACHINE_WHOSE_NONE;
    if (!machine->park.open)
        return MACHINE_WHOSE_ASKED;
    return machine->life.state == MACHINE_HOLD ? MACHINE_WHOSE_OPEN : MACHINE_WHOSE_SHUT;
}

uint8_t machine_stops(const struct machine *machine) {
    return machine->suspend.stops;
}

size_t machine_line_room(const struct machine *machine) {
    return rx_free(&machine->lines.rx);
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
