/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's hal/i2s_ll.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stdbool.h>

void i2s_ll_enable_bus_clock(int port, bool enable);
void i2s_ll_reset_register(int port);
