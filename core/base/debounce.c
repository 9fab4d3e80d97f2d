/* SPDX-License-Identifier: MIT */
#include "base/debounce.h"

void debounce_start(struct debounce *debounce, uint32_t raw) {
    debounce->raw = debounce->stable = raw;
}

static bool has_waited(const struct debounce *debounce, unsigned input, bool on, uint32_t now_us) {
    const struct debounce_time *time = &debounce->time[input];
    return now_us - debounce->since_us[input] >= (on ? time->on_us : time->off_us);
}

/* What is not as it was counts from now; what is back before its time was a glitch. */
static void take_edges(struct debounce *debounce, uint32_t raw, uint32_t now_us) {
    uint32_t edges = raw ^ debounce->raw;
    debounce->raw = raw;
    for (unsigned input = 0; edges != 0; input++, edges >>= 1) {
        if ((edges & 1) == 0)
            continue;
        debounce->since_us[input] = now_us;
        debounce->glitches[input] += ((raw ^ debounce->stable) >> input & 1) == 0;
    }
}

uint32_t debounce_sample(struct debounce *debounce, uint32_t raw, uint32_t now_us) {
    uint32_t changed = 0;
    take_edges(debounce, raw, now_us);
    uint32_t waiting = raw ^ debounce->stable;
    for (unsigned input = 0; waiting != 0; input++, waiting >>= 1)
        if ((waiting & 1) != 0 && has_waited(debounce, input, (raw >> input & 1) != 0, now_us))
            changed |= 1u << input;
    debounce->stable ^= changed;
    return changed;
}
