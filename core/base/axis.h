/* SPDX-License-Identifier: MIT
 * The axes: how many, in which order, and how a set of them is written. */
#ifndef WIFICNC_BASE_AXIS_H
#define WIFICNC_BASE_AXIS_H

#include <stdint.h>

/** Axis n of every array and bit n of every axis mask. Order is the wire's and Grbl's: X Y Z A B C. */
enum axis { AXIS_X, AXIS_Y, AXIS_Z, AXIS_A, AXIS_B, AXIS_C, AXIS_COUNT };

/** Bit n = axis n; bits from AXIS_COUNT up are 0. */
typedef uint8_t axis_mask_t;

#define AXIS_LETTERS "XYZABC"

_Static_assert(AXIS_COUNT == 6, "segment and span layouts, masks and tables are made for six axes");

#endif
