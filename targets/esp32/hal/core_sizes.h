/* SPDX-License-Identifier: MIT
 * Sizes of the core on a chip: its pin table says them (targets/<target>/pins*.toml). */
#ifndef WIFICNC_CORE_SIZES_H
#define WIFICNC_CORE_SIZES_H

#include "pin_config.h"

#define CORE_AXES    BOARD_AXIS_COUNT
#define PLAN_SIZE    BOARD_LOOK_AHEAD
#define POWER_MARKS  BOARD_LASER_MARKS
#define CORE_VECTORS 0

#endif
