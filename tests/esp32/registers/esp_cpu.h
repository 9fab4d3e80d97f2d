/* SPDX-License-Identifier: MIT
 * The processor's cycle counter of tests/esp32/pulses.c: reading it takes its time. */
#pragma once

#include <stdint.h>

uint32_t emulated_cycles(void);

#define esp_cpu_get_cycle_count emulated_cycles
