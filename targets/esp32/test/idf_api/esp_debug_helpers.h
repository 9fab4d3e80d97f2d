/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_debug_helpers.h, declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint32_t pc, sp, next_pc;
    const void *exc_frame;
} esp_backtrace_frame_t;

bool esp_backtrace_get_next_frame(esp_backtrace_frame_t *frame);
