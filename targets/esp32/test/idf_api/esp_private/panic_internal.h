/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_private/panic_internal.h, declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

typedef struct {
    int core;
    const char *reason;
    const void *addr;
    const void *frame;
} panic_info_t;
