/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's soc/rmt_struct.h, declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "sdkconfig.h"

#include <stdint.h>

/* Technical reference manuals, RMT register summary. */
typedef struct {
    uint32_t val;
} rmt_word_t;

typedef struct rmt_dev_t {
#if CONFIG_IDF_TARGET_ESP32
    volatile uint32_t data_ch[8];
    volatile struct {
        rmt_word_t conf0, conf1;
    } conf_ch[8];
#else
    volatile rmt_word_t chndata[4], chmdata[4], chnconf0[4];
#endif
} rmt_dev_t;

extern rmt_dev_t RMT;
