/* SPDX-License-Identifier: MIT
 * Counts of the spindle's encoder from readings of a 16 bit counter, and where the index line came on. Pure.
 *
 * The counter starts at 0 again when it comes to ENCODER_LIMIT or to minus that. */
#ifndef WIFICNC_ESP32_ENCODER_COUNTS_H
#define WIFICNC_ESP32_ENCODER_COUNTS_H

#include "hal/hal.h"

#include <stdint.h>

#define ENCODER_LIMIT 32000

/** What the index line's interrupt leaves: how many times it came on, wraps, and the counter's reading at the
 * newest of them, in one word. */
static inline uint32_t encoder_index_word(uint32_t before, int raw) {
    return ((before >> 16) + 1) << 16 | ((uint32_t)raw & 0xFFFFu);
}

struct encoder_counts {
    int raw;        /* of the counter, at the newest reading */
    uint32_t index; /* encoder_index_word() that was taken in */
    struct hal_encoder_state state;
};

/** How far the counter has gone from one reading to another, less than half of ENCODER_LIMIT. */
static inline int32_t encoder_change(int before, int now) {
    int32_t change = (now - before) % ENCODER_LIMIT;
    if (change >= ENCODER_LIMIT / 2)
        return change - ENCODER_LIMIT;
    return change < -ENCODER_LIMIT / 2 ? change + ENCODER_LIMIT : change;
}

/** [task] A reading, less than half of ENCODER_LIMIT from the one before and from the index. @param index
 * read behind `raw`; 0: the line never came on */
void encoder_counts_take(struct encoder_counts *counts, int raw, uint32_t index, uint32_t now_us);

#endif
