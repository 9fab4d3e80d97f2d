/* SPDX-License-Identifier: MIT
 * Switches and buttons: alarms, the door, real-time requests. [task] */
#ifndef WIFICNC_MACHINE_GUARD_H
#define WIFICNC_MACHINE_GUARD_H

#include "machine/machine.h"

/** Look at all of them. @return true when something was done about it */
bool guard_poll(struct machine *machine);

#endif
