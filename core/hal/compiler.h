/* SPDX-License-Identifier: MIT
 * Compiler words of the hot tier. */
#ifndef WIFICNC_HAL_COMPILER_H
#define WIFICNC_HAL_COMPILER_H

/** A hot HAL entry: inlined even at -Og and -Os, so that it lies in the ISR's own section. */
#define HAL_INLINE inline __attribute__((always_inline))

/** A rarely taken part of the ISR, kept out of the straight path so that the path needs no saved registers.
 */
#define HAL_SELDOM __attribute__((noinline))

#endif
