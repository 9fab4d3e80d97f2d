/* SPDX-License-Identifier: MIT
 * I2S registers of tests/esp32/pulses.c: each access first looks at what the one before has written. */
#pragma once

#include_next "hal/i2s_registers.h"

volatile struct i2s_registers *emulated_i2s(void);

#undef STEP_I2S
#define STEP_I2S emulated_i2s()
