/* SPDX-License-Identifier: MIT
 * Into a parked hold (park.h) and out of it. [task] */
#ifndef WIFICNC_MACHINE_PARKING_H
#define WIFICNC_MACHINE_PARKING_H

#include "machine/machine.h"

/** 0xA3. @param resumes  ~ has come, too */
void parking_ask(struct machine *machine, bool resumes);

/** @return true when it came further */
bool parking_poll(struct machine *machine);

#endif
