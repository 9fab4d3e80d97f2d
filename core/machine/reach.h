/* SPDX-License-Identifier: MIT
 * Whether the machine can go where a line wants it to: asked before anything of the line is done. [task] */
#ifndef WIFICNC_MACHINE_REACH_H
#define WIFICNC_MACHINE_REACH_H

#include "gcode/gcode.h"
#include "machine/machine.h"

/** The tool can go there, and every joint's counter with it: STATUS_OK, STATUS_BAD_TARGET or
 * STATUS_UNREACHABLE. From where the newest move ends. */
enum status reach_move(const struct machine *machine, const struct gcode_move *move);

/** The target lies within the travel, or soft limits are off. */
bool reach_in_travel(const struct machine *machine, const double target_mm[AXIS_COUNT]);

/** Shorten a straight way so that it ends where the travel ends, on the same line ($56). What begins outside
 * stays as it is. Soft limits off: nothing is changed. @param[in,out] target_mm  where it ends */
void reach_shorten(const struct machine *machine, const double from_mm[AXIS_COUNT],
                   double target_mm[AXIS_COUNT]);

/** The target lies outside the travel, and so everything comes to a controlled stop. */
bool reach_leaves_travel(struct machine *machine, const double target_mm[AXIS_COUNT]);

#endif
