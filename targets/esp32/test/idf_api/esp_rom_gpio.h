/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_rom_gpio.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

void esp_rom_gpio_connect_out_signal(uint32_t gpio, uint32_t signal, bool inverted, bool enable_inverted);
