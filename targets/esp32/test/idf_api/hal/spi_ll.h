/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's hal/spi_ll.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "driver/spi_master.h"

#include <stdbool.h>

void spi_ll_enable_bus_clock(spi_host_device_t host, bool enable);
void spi_ll_reset_register(spi_host_device_t host);
