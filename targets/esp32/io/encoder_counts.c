/* SPDX-License-Identifier: MIT */
#include "io/encoder_counts.h"

void encoder_counts_take(struct encoder_counts *counts, int raw, uint32_t index, uint32_t now_us) {
    struct hal_encoder_state *state = &counts->state;
    /* The counter begins again at its limit; as it is read often enough, the difference is still known. */
    int32_t change = encoder_change(counts->raw, raw);
    counts->raw = raw;
    if (change != 0) {
        state->counts = (int32_t)((uint32_t)state->counts + (uint32_t)change);
        state->edge_us = now_us;
    }
    if (index == counts->index)
        return;
    counts->index = index;
    state->index_seen = true;
    /* The index interrupt has kept the raw counter; counted back from now it becomes a place in the wide
     * count. */
    int32_t since = encoder_change((int16_t)(index & 0xFFFFu), raw);
    state->index_counts = (int32_t)((uint32_t)state->counts - (uint32_t)since);
}
