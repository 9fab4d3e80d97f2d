/* SPDX-License-Identifier: MIT
 * Axes with two motors, of a board with a chip. */
#ifndef WIFICNC_CHIP_GANGED_H
#define WIFICNC_CHIP_GANGED_H

#include "gang.h"
#include "hal/hal.h"

/** [start, behind inputs_init() and step_engine_init()] @param gang  theirs, which lives as long
 *  @return machine_board.ganged */
const struct hal_ganged *chip_ganged(struct hal *hal, struct gang *gang);

#endif
