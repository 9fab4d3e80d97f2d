/* SPDX-License-Identifier: MIT
 * Sizes of the core on this target. */
#ifndef WIFICNC_CORE_SIZES_H
#define WIFICNC_CORE_SIZES_H

#define CORE_AXES    6   /* axes of the board */
#define PLAN_SIZE    64  /* pieces of path, 100 bytes each; a power of two */
#define POWER_MARKS  256 /* changes of a laser's S in it, 8 bytes each; a power of two */
#define CORE_VECTORS 0   /* 1: the processor has vector registers (motion/vec.h) */

#endif
