/* SPDX-License-Identifier: MIT
 * Real-time requests: report, reset, hold, door, overrides. They may stop, scale or flush; they start nothing
 * new. [task] */
#ifndef WIFICNC_MACHINE_REALTIME_H
#define WIFICNC_MACHINE_REALTIME_H

#include "machine/machine.h"

/** Take what has come. @return true when there was something */
bool realtime_poll(struct machine *machine);

#endif
