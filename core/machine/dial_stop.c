/* SPDX-License-Identifier: MIT
 * What stops the dial, and what waits for it. */
#include "machine/dial.h"

#include "machine/parts.h"
#include "machine/timer.h"

void dial_stop(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    if (dial == NULL)
        return;
    dial->wanted = 0;
    dial->moves = dial->pushes = dial->turns_back = false;
    dial->locked = true;
    timer_start(machine, &dial->rest, DIAL_REST_US);
}

bool dial_moves(const struct machine *machine) {
    return machine->board.dial_state != NULL && machine->board.dial_state->moves;
}
