/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's soc/gpio_struct.h, declared again: enough to compile against, checked against
 * the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stdint.h>

/* Technical reference manuals, GPIO register summary: offsets 0x08 .. 0x58 are the same on both chips. */
typedef struct {
    uint32_t val;
} gpio_word_t;

typedef volatile struct {
    uint32_t bt_select, out, out_w1ts, out_w1tc;
    gpio_word_t out1, out1_w1ts, out1_w1tc, sdio_select;
    uint32_t enable, enable_w1ts, enable_w1tc;
    gpio_word_t enable1, enable1_w1ts, enable1_w1tc, strap;
    uint32_t in;
    gpio_word_t in1;
    uint32_t status, status_w1ts, status_w1tc;
    gpio_word_t status1, status1_w1ts, status1_w1tc;
} gpio_dev_t;

extern gpio_dev_t GPIO;
