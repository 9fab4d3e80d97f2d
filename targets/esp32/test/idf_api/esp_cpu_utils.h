/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_cpu_utils.h, declared again: enough to compile against, checked against
 * the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stdint.h>

static inline uint32_t esp_cpu_process_stack_pc(uint32_t pc) {
    return (pc & 0x80000000u ? (pc & 0x3FFFFFFFu) | 0x40000000u : pc) - 3;
}
