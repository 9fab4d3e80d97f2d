/* SPDX-License-Identifier: MIT */
#include "io/dial_counts.h"

#include "io/encoder_counts.h"

void dial_counts_begin(struct dial_counts *counts, uint8_t phase) {
    *counts = (struct dial_counts){.offset = (uint8_t)(-phase & 3)};
}

void dial_counts_take(struct dial_counts *counts, int raw, uint8_t phase) {
    const int32_t change = encoder_change(counts->raw, raw);
    counts->raw = raw;
    counts->counts = (int32_t)((uint32_t)counts->counts + (uint32_t)change);
    const uint8_t offset = (uint8_t)((counts->counts - phase) & 3);
    if (offset == counts->offset) {
        counts->doubt = false;
    } else if (change != 0 || !counts->doubt) {
        counts->doubt = true;
    } else {
        counts->slips++;
        counts->offset = offset;
        counts->doubt = false;
    }
}
