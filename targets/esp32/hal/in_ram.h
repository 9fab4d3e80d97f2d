/* SPDX-License-Identifier: MIT
 * Places a function of ours in internal RAM, where interrupts find it while the flash is written. Files that
 * are also compiled on a computer use this instead of ESP-IDF's own word. */
#ifndef WIFICNC_ESP32_IN_RAM_H
#define WIFICNC_ESP32_IN_RAM_H

#ifdef ESP_PLATFORM
#include "esp_attr.h"
#define IN_RAM IRAM_ATTR
#else
#define IN_RAM
#endif

#endif
