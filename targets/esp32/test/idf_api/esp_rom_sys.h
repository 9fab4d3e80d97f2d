/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_rom_sys.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stdint.h>

void esp_rom_delay_us(uint32_t us);
