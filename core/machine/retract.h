/* SPDX-License-Identifier: MIT
 * Parking ($42): at the safety door, and by choice in a feed hold, Z goes up before spindle and coolant stop.
 * `~` starts them there, and then Z goes down to where the job was left (preempt.h). [task] */
#ifndef WIFICNC_MACHINE_RETRACT_H
#define WIFICNC_MACHINE_RETRACT_H

#include "machine/machine.h"

/** $42. */
enum retract_mode { RETRACT_NEVER, RETRACT_AT_DOOR, RETRACT_IN_HOLD };

/** At rest behind the door, or in a hold: up, if that is asked for, possible and not done yet.
 * @return true: Z moves now */
bool retract_begin(struct machine *machine);

#endif
