/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_freertos_hooks.h, declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "esp_err.h"

#ifndef INC_FREERTOS_H
#error "ESP-IDF's includes freertos/portmacro.h, which does not compile before freertos/FreeRTOS.h"
#endif

typedef void (*esp_freertos_tick_cb_t)(void);

esp_err_t esp_register_freertos_tick_hook_for_cpu(esp_freertos_tick_cb_t hook, unsigned cpu);
