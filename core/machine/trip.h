/* SPDX-License-Identifier: MIT
 * Motion stops within its limits, and an alarm follows: for faults that do not endanger more when motion
 * lasts until it has slowed down. [task] */
#ifndef WIFICNC_MACHINE_TRIP_H
#define WIFICNC_MACHINE_TRIP_H

#include "machine/machine.h"
#include "machine/timer.h"

struct machine_trip {
    bool on;                    /* motion is being stopped, and the alarm follows */
    struct machine_timer limit; /* ... at the end of this at the latest */
};

/** An alarm makes sense: in an alarm and asleep nothing moves. */
bool trip_may(const struct machine *machine);

/** Hold what moves, so that `~` does not resume it and no further jog begins. */
void trip_hold(struct machine *machine);

/** To be called again and again. @return true when the alarm has come */
bool trip_poll(struct machine *machine, struct machine_trip *trip, enum alarm alarm);

#endif
