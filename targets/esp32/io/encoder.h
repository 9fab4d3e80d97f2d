/* SPDX-License-Identifier: MIT
 * The spindle's encoder: the pulse counter (PCNT) decodes A and B, four counts a line; A before B is
 * clockwise. [task]
 *
 * The counter stamps no edges: an edge counts as come when a read has first seen it, which is a poll (1 ms)
 * or less after it. With 400 counts a revolution and more that is a part of a step; docs/threading.md. The
 * index line is not used: the place at power-on serves. */
#ifndef WIFICNC_ESP32_ENCODER_H
#define WIFICNC_ESP32_ENCODER_H

#include "hal/hal.h"

#include <stdbool.h>
#include <stdint.h>

/** The hardware's counter starts at 0 again when it comes to this or to minus this. */
#define ENCODER_LIMIT 32000

struct encoder_wire {
    uint8_t gpio; /* GPIO_NONE: not wired */
    bool active_high;
};

struct encoder {
    void *unit; /* pcnt_unit_handle_t; NULL: there is none */
    int raw;    /* of the hardware, at the newest read */
    struct hal_encoder_state state;
};

/** How far the hardware's counter has gone from one reading to another, less than half of ENCODER_LIMIT. */
static inline int32_t encoder_change(int before, int now) {
    int32_t change = (now - before) % ENCODER_LIMIT;
    if (change >= ENCODER_LIMIT / 2)
        return change - ENCODER_LIMIT;
    return change < -ENCODER_LIMIT / 2 ? change + ENCODER_LIMIT : change;
}

/** [start] @return false: A or B is not wired, or the pulse counter did not start */
bool encoder_init(struct encoder *encoder, const struct encoder_wire *a, const struct encoder_wire *b);

/** struct hal_encoder.read */
void encoder_read(struct encoder *encoder, uint32_t now_us, struct hal_encoder_state *out);

#endif
