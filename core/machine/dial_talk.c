/* SPDX-License-Identifier: MIT
 * Messages of the dial. */
#include "machine/dial_talk.h"

#include "machine/dial.h"
#include "machine/parts.h"
#include "machine/report.h"
#include "machine/state.h"

enum { GATHER_US = 300000, QUIET_US = 5000000 };

void dial_talk_soon(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    if (dial->gathers)
        return;
    dial->gathers = true;
    timer_start(machine, &dial->gather, GATHER_US);
}

static void say_number(const struct machine *machine, const char *before, uint32_t number,
                       const char *after) {
    text_string(&machine->out, before);
    text_int(&machine->out, (int32_t)number);
    text_string(&machine->out, after);
}

void dial_talk_poll(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    dial->quiet.on = timer_runs(machine, &dial->quiet); /* before the clock wraps */
    dial->gather.on = timer_runs(machine, &dial->gather);
    if (!dial->gathers || dial->gather.on || dial->quiet.on || !text_has_room(&machine->out))
        return;
    dial->gathers = false;
    timer_start(machine, &dial->quiet, QUIET_US);
    if (dial->dropped != 0)
        say_number(machine, "[MSG:Dial: turned too fast, ", dial->dropped, " detents dropped]\r\n");
    if (dial->slipped != 0)
        say_number(machine, "[MSG:Dial: ", dial->slipped,
                   " impossible signals; check its cable, shield and ground]\r\n");
    if (dial->ends)
        report_message(machine, "Dial: the travel ends here");
    if (dial->ignored)
        report_message(machine, "Dial ignored: let it rest, then turn it while nothing else moves");
    dial->dropped = dial->slipped = 0;
    dial->ignored = dial->ends = false;
}

uint32_t dial_wait_us(const struct machine *machine) {
    const struct machine_dial *dial = machine->board.dial_state;
    if (dial == NULL || !dial->gathers)
        return UINT32_MAX;
    const uint32_t gather_us = timer_left_us(machine, &dial->gather);
    const uint32_t quiet_us = timer_left_us(machine, &dial->quiet);
    if (gather_us == UINT32_MAX)
        return quiet_us;
    return quiet_us == UINT32_MAX || quiet_us < gather_us ? gather_us : quiet_us;
}
