/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's soc/timer_group_struct.h, declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "sdkconfig.h"

#include <stdint.h>

/* Technical reference manuals, timer group register summary. */
typedef struct {
    uint32_t val;
} timg_word_t;

typedef volatile struct timg_dev_t {
    struct {
        timg_word_t config, lo, hi, update, alarmlo, alarmhi, loadlo, loadhi, load;
    } hw_timer[2];
    uint32_t watchdog_and_calibration[10];
#if CONFIG_IDF_TARGET_ESP32
    uint32_t lact[10];
#endif
    timg_word_t int_ena_timers, int_raw_timers, int_st_timers, int_clr_timers;
} timg_dev_t;

extern timg_dev_t TIMERG0;
