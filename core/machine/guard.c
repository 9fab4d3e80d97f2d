/* SPDX-License-Identifier: MIT
 * Switches and buttons: alarms, the door, real-time requests. */
#include "machine/guard.h"

#include "machine/faults.h"
#include "machine/inputs.h"
#include "machine/parts.h"
#include "machine/reset.h"
#include "machine/suspend.h"
#include "machine/switches.h"

static uint32_t pressed(const struct hal_inputs *now, const struct hal_inputs *before) {
    uint32_t bits = 0;
    bits |= now->hold && !before->hold ? REALTIME_HOLD : 0;
    bits |= now->start && !before->start ? REALTIME_RESUME : 0;
    bits |= now->reset && !before->reset ? REALTIME_RESET : 0;
    return bits;
}

/* Which of a stop and the start button came first is not known when both are new: the stop counts. */
static uint32_t without_doubt(const struct rx *rx, uint32_t bits) {
    bool stops = ((bits | __atomic_load_n(&rx->realtime, __ATOMIC_RELAXED)) & REALTIME_STOPS) != 0;
    return stops ? bits & ~(uint32_t)REALTIME_RESUME : bits;
}

/* The switches are not as they were at the last edge. */
static bool are_news(const struct machine *machine, const struct hal_inputs *now) {
    struct switch_lines lines = switch_lines_of(&now->switches, machine->settings.limit_invert);
    const struct switches *known = &machine->edges.switches;
    return ((lines.limits ^ known->closed.limits) & ~known->waiting.limits) != 0 ||
           ((lines.homes ^ known->closed.homes) & ~known->waiting.homes) != 0;
}

uint8_t guard_idle_starts(const struct machine *machine) {
    return machine->idle_starts;
}

bool guard_poll(struct machine *machine) {
    struct hal_inputs before = machine->inputs;
    hal_inputs_read(machine->hal, &machine->inputs);
    const struct hal_inputs *now = &machine->inputs;
    state_note_estop(&machine->life, now->estop);
    overrides_see_switch(machine, before.digital);
    if (are_news(machine, now)) /* the end of debouncing; or a board without edge interrupts for them */
        inputs_look(machine);
    /* The edge counts, too: the e-stop may have been released again before this poll. It does not count
     * twice: not in a critical alarm, nor before the banner that a reset is about to print. */
    if ((now->estop || machine->edges.estop) && !machine->life.critical && !machine->life.restart) {
        reset_alarm(machine, now->lock != HAL_LOCK_NONE ? ALARM_LOCKED : ALARM_ESTOP);
        return true;
    }
    if (machine->edges.hard_limit) {
        reset_alarm(machine, ALARM_HARD_LIMIT);
        return true;
    }
    if (faults_poll(machine))
        return true;
    const bool idle = machine->life.state == MACHINE_IDLE || machine->life.state == MACHINE_ALARM;
    if (now->start && !before.start && idle)
        machine->idle_starts++;
    if ((now->hold && !before.hold) || (now->reset && !before.reset))
        machine_stopped_by_other(machine);
    /* Buttons are the same requests as the bytes ! ~ and 0x18, and are carried out with them by
     * realtime_poll(). */
    rx_request(&machine->lines.rx, without_doubt(&machine->lines.rx, pressed(now, &before)));
    if (now->door && !machine->life.critical && !machine->life.restart &&
        machine->life.state != MACHINE_DOOR) {
        enum machine_state state = machine->life.state;
        suspend_open_door(machine);
        return machine->life.state != state;
    }
    return false;
}
