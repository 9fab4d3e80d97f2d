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

#endif
