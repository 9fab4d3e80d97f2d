/* SPDX-License-Identifier: MIT
 * Sizes of the core on a PC: those of the largest chip. host_board.look_ahead and laser_marks limit them
 * to those of a board. */
#ifndef WIFICNC_CORE_SIZES_H
#define WIFICNC_CORE_SIZES_H

#define CORE_AXES    6
#define PLAN_SIZE    256
#define POWER_MARKS  2048
#define CORE_VECTORS 1

#endif
