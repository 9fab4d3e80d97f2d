/* SPDX-License-Identifier: MIT
 * The states of the machine and what leads from one to the next. Sub-states (Hold:1, Door:2) are not states:
 * they are seen from motion and inputs when a report asks. [task] */
#ifndef WIFICNC_MACHINE_STATE_H
#define WIFICNC_MACHINE_STATE_H

#include "machine/machine.h"

/** State, alarm and reset. */
struct machine_life {
    enum machine_state state;
    enum alarm alarm;        /* the newest; ALARM_NONE after a reset */
    bool locks_again;        /* the e-stop came while the machine was locked: it is locked after it, too */
    bool critical;           /* after alarm 1, 2 or e-stop: only a reset helps */
    bool critical_untold;    /* ... and that was not said yet */
    bool release_told;       /* ... but that the e-stop must be released first */
    bool estop_was_released; /* since start: something is wired there */
    bool restart;            /* the banner is due */
    bool reset_asked;        /* by a $ command */
    bool restarted;          /* locked since a restart that was not requested: board.restart */
};

/** [task] How the e-stop's input is, at each look. */
static inline void state_note_estop(struct machine_life *life, bool pressed) {
    life->estop_was_released |= !pressed;
}

/** Reset at the next look at real-time requests. */
static inline void state_ask_reset(struct machine_life *life, bool asked) {
    life->reset_asked = asked;
}

/** The alarm that a machine is in from its start: damaged storage, a restart that was not requested; or none.
 */
static inline void state_show_alarm(struct machine_life *life, enum alarm alarm) {
    life->alarm = alarm;
}

/** What can happen to the state. */
enum machine_event {
    EVENT_START,  /* motion begins */
    EVENT_REST,   /* everything is done */
    EVENT_HOLD,   /* ! or M0 */
    EVENT_RESUME, /* ~ */
    EVENT_JOG,
    EVENT_OPEN, /* the door */
    EVENT_PARK, /* 0xA3 behind a closed door */
    EVENT_ALARM,
    EVENT_UNLOCK, /* $X */
    EVENT_CHECK,  /* $C */
    EVENT_HOME,   /* $H */
    EVENT_SLEEP,  /* $SLP */
    EVENT_RESET,
    EVENT_COUNT
};

/** Continue to the next state. @return false: the event means nothing in this state, and nothing changed. */
bool state_go(struct machine *machine, enum machine_event event);

/** Work has begun, or all of it is done. @return true when the state changed */
bool state_update(struct machine *machine);

/** Clients or the dial may begin something in this state. */
bool state_takes_input(const struct machine *machine);

/** ... and lines are read: they wait while the dial moves an axis. */
bool state_reads(const struct machine *machine);

/** Tasks continue in this state. */
bool state_works(const struct machine *machine);

/** Grbl's longer report intervals. */
bool state_is_busy(const struct machine *machine);

/** Power-on. */
void state_begin(struct machine *machine, bool locked);

#endif
