/* SPDX-License-Identifier: MIT
 * States and alarms, as everyone sees them. What leads from one state to the next: machine/state.h. */
#ifndef WIFICNC_MACHINE_STATES_H
#define WIFICNC_MACHINE_STATES_H

enum machine_state {
    MACHINE_IDLE,
    MACHINE_RUN,
    MACHINE_HOLD, /* ! or M0: waits for ~ */
    MACHINE_JOG,
    MACHINE_ALARM, /* locked until $X, $H or reset; position may be wrong */
    MACHINE_DOOR,  /* safety door: outputs off, waits for a closed door and ~ */
    MACHINE_CHECK, /* $C: lines are read, nothing moves */
    MACHINE_HOME,
    MACHINE_SLEEP, /* $SLP: waits for reset */
    MACHINE_STATE_COUNT
};

/** ALARM_HARD_LIMIT = 1 and so on. */
enum alarm {
    ALARM_NONE = 0,
#define ALARM(number, name, way_out, text) ALARM_##name = (number),
#include "machine/alarms.def"
#undef ALARM
};

#endif
