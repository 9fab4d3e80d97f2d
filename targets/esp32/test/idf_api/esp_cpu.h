/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_cpu.h, declared again: enough to compile against, checked against the real
 * one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stdint.h>

static inline __attribute__((always_inline)) uint32_t esp_cpu_get_cycle_count(void) {
    uint32_t count;
    __asm__ __volatile__("rsr %0, ccount" : "=r"(count));
    return count;
}
