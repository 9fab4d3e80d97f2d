/* SPDX-License-Identifier: MIT
 * Laser mode ($32): how much of S the beam has now. [task] docs/laser.md has the rule in words. */
#ifndef WIFICNC_MACHINE_LASER_H
#define WIFICNC_MACHINE_LASER_H

#include <stdbool.h>

struct machine;

/** S that the laser output has to show now, before $30 and $31; 0: dark. The only place that lights the beam.
 * Only with M3 or M4 in force.
 * @param factor  spindle override */
float laser_rpm(const struct machine *machine, float factor);

/** M3 or S was commanded: the aiming beam ($89) comes on for $90, unless something moves. */
void laser_aim(struct machine *machine);

/** The aiming beam ends with its time, and with whatever else happens. */
void laser_poll(struct machine *machine);

#endif
