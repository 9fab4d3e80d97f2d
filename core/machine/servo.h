/* SPDX-License-Identifier: MIT
 * An RC servo in the place of an axis' motor, such as a pen lift: its pulse says where the axis is.
 * [task]
 *
 *     -travel .. 0 mm of the axis $85  ->  $86 .. $87 us, 50 times a second
 *
 * The axis moves, is limited and counts as if its motor were there. [task] */
#ifndef WIFICNC_MACHINE_SERVO_H
#define WIFICNC_MACHINE_SERVO_H

#include "machine/machine.h"

/** Its pulse is that of where the axis is. */
void servo_poll(struct machine *machine);

#endif
