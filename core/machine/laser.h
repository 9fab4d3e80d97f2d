/* SPDX-License-Identifier: MIT
 * Laser mode ($32): how much of S the beam has now. [task] docs/laser.md has the rule in words. */
#ifndef WIFICNC_MACHINE_LASER_H
#define WIFICNC_MACHINE_LASER_H

struct machine;

/** S that the laser output has to show now, before overrides and limits; 0: dark. The only place that lights
 * the beam. */
float laser_rpm(const struct machine *machine);

#endif
