/* SPDX-License-Identifier: MIT
 * Which axes home, in which cycle and towards which end; and which of them are not homed. [task] */
#ifndef WIFICNC_MACHINE_AXES_H
#define WIFICNC_MACHINE_AXES_H

#include "machine/machine.h"

/** Axes that $H would home and whose position is not trusted. */
axis_mask_t axes_not_homed(const struct machine *machine);

/** 1, or -1 where $23 says that the axis homes towards its negative end. */
double axes_direction(const struct machine *machine, unsigned axis);

/** Cycles of homing, $44 .. $49. */
enum { CYCLE_COUNT = 6 };

/** What is homed in a cycle. */
axis_mask_t axes_of_cycle(const struct machine *machine, unsigned cycle);

/** Axes of any cycle. */
axis_mask_t axes_in_cycles(const struct machine *machine);

/** Axes with an end: an endless one has nothing to find. */
axis_mask_t axes_with_ends(const struct machine *machine);

#endif
