/* SPDX-License-Identifier: MIT
 * Words for shift registers, into the I2S peripheral's FIFO. After hal_step.h's structure. */
#ifndef WIFICNC_ESP32_I2S_WORDS_H
#define WIFICNC_ESP32_I2S_WORDS_H

#include "hal/i2s_registers.h"

/* @param count  above 0 */
static HAL_INLINE void step_i2s_put(uint32_t word, uint32_t count) {
    do
        STEP_I2S->fifo_wr = word;
    while (--count != 0);
}

/* All outputs without a pulse. */
static HAL_INLINE uint32_t step_i2s_rest(const struct hal_step *hal) {
    return __atomic_load_n(&hal->shifted, __ATOMIC_RELAXED) | hal->i2s_lines;
}

#endif
