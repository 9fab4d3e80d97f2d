/* SPDX-License-Identifier: MIT
 * Switches and buttons: alarms, the door, real-time requests. [task] */
#ifndef WIFICNC_MACHINE_GUARD_H
#define WIFICNC_MACHINE_GUARD_H

#include "machine/machine.h"

/** Look at all of them. @return true when something was done about it */
bool guard_poll(struct machine *machine);

/** How often the start button was pressed while the machine was idle or locked, so nothing waited for it;
 * wraps. Who is in front of the machine may say something by it. */
uint8_t guard_idle_starts(const struct machine *machine);

#endif
