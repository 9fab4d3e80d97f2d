/* SPDX-License-Identifier: MIT
 * Laser mode ($32): when the beam may be lit, and with how much of S. [task] docs/laser.md has the rule in
 * words. */
#ifndef WIFICNC_MACHINE_LASER_H
#define WIFICNC_MACHINE_LASER_H

#include <stdbool.h>

struct machine;

/** What cuts burn from now on, whether they may, and the aiming beam. The only place that lights the beam.
 * Without $32 the output is not a laser's.
 * @param on  M3 or M4 is in force, and nothing keeps the beam off
 * @param factor  spindle override */
void laser_apply(struct machine *machine, bool on, float factor);

/** S that the laser output shows now; 0: dark. Only with M3 or M4 in force. */
float laser_rpm(const struct machine *machine, float factor);

/** M3 or S was commanded: the aiming beam ($89) comes on for $90, unless something moves. */
void laser_aim(struct machine *machine);

/** The aiming beam ends with its time, if $90 gives it one, and with whatever else happens. */
void laser_poll(struct machine *machine);

#endif
