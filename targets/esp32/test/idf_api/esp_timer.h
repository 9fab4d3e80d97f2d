/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_timer.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stdint.h>

int64_t esp_timer_get_time(void);
