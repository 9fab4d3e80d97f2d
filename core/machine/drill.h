/* SPDX-License-Identifier: MIT
 * Canned cycles: the actions of gcode/cycle.h, one after the other. [task] */
#ifndef WIFICNC_MACHINE_DRILL_H
#define WIFICNC_MACHINE_DRILL_H

#include "machine/machine.h"

/** The cycle of the present line begins where the program is. */
void drill_begin(struct machine *machine);

/** @return TASK_NONE when the cycle is done */
enum task_stage drill_poll(struct machine *machine);

#endif
