/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's hal/pcnt_ll.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stdint.h>

/* Technical reference manuals, pulse counter: four (eight on the ESP32) configuration blocks, then the
 * counters. */
typedef volatile struct pcnt_dev_t {
    uint32_t conf_unit[8][3], cnt_unit[8];
} pcnt_dev_t;

extern pcnt_dev_t PCNT;

static inline __attribute__((always_inline)) int pcnt_ll_get_count(pcnt_dev_t *hw, uint32_t unit) {
    return (int16_t)hw->cnt_unit[unit];
}

static inline int pcnt_ll_get_high_limit_value(pcnt_dev_t *hw, uint32_t unit) {
    return (int16_t)hw->conf_unit[unit][2];
}
