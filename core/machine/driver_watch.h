/* SPDX-License-Identifier: MIT
 * What a fault of a motor driver with registers leads to: one message, a feed hold, and alarm 54 ($746).
 * [task] */
#ifndef WIFICNC_MACHINE_DRIVER_WATCH_H
#define WIFICNC_MACHINE_DRIVER_WATCH_H

#include <stdbool.h>

struct machine;

/** Settings and homing to the drivers; problems to the user; stop when one is new. Before motion is
 * published.
 *  @return true when something was done */
bool driver_watch_poll(struct machine *machine);

#endif
