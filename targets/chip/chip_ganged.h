/* SPDX-License-Identifier: MIT
 * Axes with two motors, of a board with a chip. */
#ifndef WIFICNC_CHIP_GANGED_H
#define WIFICNC_CHIP_GANGED_H

#include "gang.h"
#include "hal/hal.h"

/** [start] @return machine_board.ganged; NULL: every axis has one motor */
const struct hal_ganged *chip_ganged(struct hal *hal, const struct gang *gang);

#endif
