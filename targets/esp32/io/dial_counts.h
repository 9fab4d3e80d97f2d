/* SPDX-License-Identifier: MIT
 * Counts of the dial from readings of a 16 bit counter, and signals that no wheel makes. Pure.
 *
 * The counter sees edges, not levels. Where the levels of both lines do not fit its count any more, it has
 * missed an edge or counted noise. Its filter makes it late by 12 us, so one reading proves nothing: the next
 * one does, with the same count. */
#ifndef WIFICNC_ESP32_DIAL_COUNTS_H
#define WIFICNC_ESP32_DIAL_COUNTS_H

#include <stdbool.h>
#include <stdint.h>

struct dial_counts {
    int raw; /* of the counter, at the newest reading */
    int32_t counts;
    uint32_t slips;
    uint8_t offset; /* of the count against the phase of the lines, 0 .. 3 */
    bool doubt;     /* the newest reading had another one */
};

/** The counter is at 0, and the lines are at this phase (base/quadrature.h). */
void dial_counts_begin(struct dial_counts *counts, uint8_t phase);

/** [task] A reading, less than half of ENCODER_LIMIT from the one before. */
void dial_counts_take(struct dial_counts *counts, int raw, uint8_t phase);

#endif
