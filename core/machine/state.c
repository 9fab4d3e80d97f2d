/* SPDX-License-Identifier: MIT
 * The states of the machine and what leads from one to the next. Sub-states (Hold:1, Door:2) are not states:
 * they are seen from motion and inputs when a report asks. */
#include "machine/state.h"

#include "machine/dial.h"
#include "machine/drive.h"
#include "machine/inputs.h"
#include "machine/overrides.h"
#include "machine/parts.h"

/* An event without an entry means nothing in that state. Entries are one more than the state, so that 0,
 * which C puts where nothing is written, is no state. */
#define TO(state) ((uint8_t)((state) + 1))

/* clang-format off */
static const uint8_t next[MACHINE_STATE_COUNT][EVENT_COUNT] = {
    [MACHINE_IDLE] = {
        [EVENT_START] = TO(MACHINE_RUN),    [EVENT_HOLD] = TO(MACHINE_HOLD),
        [EVENT_JOG] = TO(MACHINE_JOG),      [EVENT_OPEN] = TO(MACHINE_DOOR),
        [EVENT_CHECK] = TO(MACHINE_CHECK),  [EVENT_HOME] = TO(MACHINE_HOME),
        [EVENT_SLEEP] = TO(MACHINE_SLEEP),  [EVENT_ALARM] = TO(MACHINE_ALARM),
        [EVENT_RESET] = TO(MACHINE_IDLE)},
    [MACHINE_RUN] = {
        [EVENT_REST] = TO(MACHINE_IDLE),    [EVENT_HOLD] = TO(MACHINE_HOLD),
        [EVENT_OPEN] = TO(MACHINE_DOOR),    [EVENT_ALARM] = TO(MACHINE_ALARM),
        [EVENT_RESET] = TO(MACHINE_IDLE)},
    [MACHINE_HOLD] = {
        [EVENT_RESUME] = TO(MACHINE_IDLE),  [EVENT_OPEN] = TO(MACHINE_DOOR),
        [EVENT_ALARM] = TO(MACHINE_ALARM),  [EVENT_RESET] = TO(MACHINE_IDLE)},
    [MACHINE_JOG] = {
        [EVENT_REST] = TO(MACHINE_IDLE),    [EVENT_JOG] = TO(MACHINE_JOG),
        [EVENT_OPEN] = TO(MACHINE_DOOR),    [EVENT_ALARM] = TO(MACHINE_ALARM),
        [EVENT_RESET] = TO(MACHINE_IDLE)},
    [MACHINE_ALARM] = {
        [EVENT_UNLOCK] = TO(MACHINE_IDLE),  [EVENT_HOME] = TO(MACHINE_HOME),
        [EVENT_SLEEP] = TO(MACHINE_SLEEP),  [EVENT_ALARM] = TO(MACHINE_ALARM),
        [EVENT_RESET] = TO(MACHINE_ALARM)},
    [MACHINE_DOOR] = {
        [EVENT_RESUME] = TO(MACHINE_IDLE),  [EVENT_PARK] = TO(MACHINE_HOLD),
        [EVENT_ALARM] = TO(MACHINE_ALARM),  [EVENT_RESET] = TO(MACHINE_IDLE)},
    [MACHINE_CHECK] = {
        [EVENT_ALARM] = TO(MACHINE_ALARM),  [EVENT_RESET] = TO(MACHINE_IDLE)},
    [MACHINE_HOME] = {
        [EVENT_REST] = TO(MACHINE_IDLE),    [EVENT_ALARM] = TO(MACHINE_ALARM),
        [EVENT_RESET] = TO(MACHINE_ALARM)},
    [MACHINE_SLEEP] = {
        [EVENT_ALARM] = TO(MACHINE_ALARM),  [EVENT_RESET] = TO(MACHINE_ALARM)},
};
/* clang-format on */

static const struct {
    const char *name; /* NULL: with a sub-state, see machine_state_text() */
    bool reads;       /* lines are read */
    bool works;       /* tasks continue */
    bool busy;        /* the long report intervals */
} traits[MACHINE_STATE_COUNT] = {
    [MACHINE_IDLE] = {.name = "Idle", .reads = true, .works = true},
    [MACHINE_RUN] = {.name = "Run", .reads = true, .works = true, .busy = true},
    [MACHINE_HOLD] = {.busy = true},
    [MACHINE_JOG] = {.name = "Jog", .reads = true, .works = true, .busy = true},
    [MACHINE_ALARM] = {.name = "Alarm", .reads = true, .works = true},
    [MACHINE_DOOR] = {.busy = true},
    [MACHINE_CHECK] = {.name = "Check", .reads = true, .works = true},
    [MACHINE_HOME] = {.name = "Home", .works = true, .busy = true},
    [MACHINE_SLEEP] = {.name = "Sleep"},
};

bool state_go(struct machine *machine, enum machine_event event) {
    uint8_t to = next[machine->life.state][event];
    if (to == 0)
        return false;
    const bool begins = to - 1 == MACHINE_CHECK;
    if (begins || machine->life.state == MACHINE_CHECK)
        interp_check(&machine->interp, &machine->aside.unchecked, begins);
    machine->life.state = (enum machine_state)(to - 1);
    if (machine->life.state == MACHINE_IDLE) /* unlocked, or homed */
        machine->life.restarted = false;
    return true;
}

/* In addition to the state: no line is read between the cancel of a jog and its rest, nor while a reset by a
 * command is due, nor while motion is a remote host's or on its way to it or back. */
bool state_takes_input(const struct machine *machine) {
    if (machine->park.open)
        return machine->life.state == MACHINE_HOLD && !machine->park.stops;
    return traits[machine->life.state].reads && !machine->suspend.cancels && !machine->life.reset_asked &&
           !machine->host.owns && machine->host.job.step == HOST_JOB_NONE;
}

bool state_reads(const struct machine *machine) {
    return state_takes_input(machine) && !dial_moves(machine);
}

bool state_works(const struct machine *machine) {
    if (machine->park.open)
        return machine->life.state == MACHINE_HOLD;
    return traits[machine->life.state].works && !machine->suspend.cancels &&
           machine->host.job.step == HOST_JOB_NONE;
}

bool state_is_busy(const struct machine *machine) {
    return traits[machine->life.state].busy;
}

const char *machine_state_text(const struct machine *machine) {
    bool stopped = drive_is_stopped(machine);
    if (machine->life.state == MACHINE_HOLD && machine->park.tool && stopped)
        return "Tool";
    if (machine->life.state == MACHINE_HOLD)
        return stopped ? "Hold:0" : "Hold:1";
    if (machine->life.state != MACHINE_DOOR)
        return traits[machine->life.state].name;
    if (machine->suspend.restores)
        return "Door:3";
    if (!stopped)
        return "Door:2";
    return inputs_door_is_open(machine) ? "Door:1" : "Door:0";
}

void state_begin(struct machine *machine, bool locked) {
    machine->life.restarted = machine->board.restart != NULL;
    machine->life.state = locked || machine->life.restarted ? MACHINE_ALARM : MACHINE_IDLE;
}

bool state_update(struct machine *machine) {
    if (machine->life.state == MACHINE_IDLE)
        return (machine->task.stage != TASK_NONE || !machine_is_at_rest(machine)) &&
               state_go(machine, EVENT_START);
    bool works = !machine_is_at_rest(machine) || machine->task.stage != TASK_NONE;
    if (works || machine->suspend.cancels || machine->life.state == MACHINE_HOME)
        return false;
    bool jogged = machine->life.state == MACHINE_JOG;
    if (!state_go(machine, EVENT_REST))
        return false;
    if (jogged)
        overrides_apply(machine); /* which did not count for the jog */
    return true;
}
