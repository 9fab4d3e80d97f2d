/* SPDX-License-Identifier: MIT
 * The spindle's encoder: the pulse counter (PCNT) decodes A and B, four counts a line; A before B is
 * clockwise. [task, and the index line's interrupt]
 *
 * The counter stamps no edges: an edge counts as come when a read has first seen it, which is a poll (1 ms)
 * or less after it. With 400 counts a revolution and more that is a part of a step; docs/threading.md.
 *
 * When the index line comes on, an interrupt reads the counter. It is late by a few us, some 10 us at most:
 * at 3000 rpm that is a 20000th of a revolution, at most a 2000th. */
#ifndef WIFICNC_ESP32_ENCODER_H
#define WIFICNC_ESP32_ENCODER_H

#include "io/encoder_counts.h"

#include <stdbool.h>
#include <stdint.h>

struct encoder_wire {
    uint8_t gpio; /* NO_PIN: not wired */
    bool active_high;
    uint8_t pull; /* PIN_PULL_ of pin_config.h */
};

/** Lines of the encoder. */
enum { ENCODER_A, ENCODER_B, ENCODER_INDEX, ENCODER_LINES };

/** In internal RAM. */
struct encoder {
    void *unit; /* pcnt_unit_handle_t; NULL: none exists */
    struct encoder_counts counts;
    volatile uint32_t index; /* encoder_index_word(), of the interrupt */
};

/** [start] @return false: A or B is not wired, or the pulse counter did not start */
bool encoder_init(struct encoder *encoder, const struct encoder_wire wire[ENCODER_LINES]);

/** struct hal_encoder.read */
void encoder_read(struct encoder *encoder, uint32_t now_us, struct hal_encoder_state *out);

/** [isr] The index line has come on. */
void encoder_index_isr(struct encoder *encoder);

#endif
