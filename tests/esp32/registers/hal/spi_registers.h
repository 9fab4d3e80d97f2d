/* SPDX-License-Identifier: MIT
 * SPI registers of tests/esp32/pulses.c: each access first looks at what the one before has written. */
#pragma once

#include_next "hal/spi_registers.h"

volatile struct spi_registers *emulated_spi(void);

#undef STEP_SPI
#define STEP_SPI emulated_spi()
