/* SPDX-License-Identifier: MIT
 * One straight move of the current line, handed to the planner. [task] */
#ifndef WIFICNC_MACHINE_MOVES_H
#define WIFICNC_MACHINE_MOVES_H

#include "machine/machine.h"

/** One straight move of the current line. @return false: no room now */
bool moves_push(struct machine *machine, const double target_mm[AXIS_COUNT], bool rapid, float feed_mm_s,
                float duration_s);

#endif
