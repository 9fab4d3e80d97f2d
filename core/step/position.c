/* SPDX-License-Identifier: MIT
 * Position in closed form from the span being stepped: no counter can ever differ from the pulses. */
#include "step/isr.h"

/* Acquire loads keep their order, so the caller's second look at the ring comes after the span was read. */
#define LOAD(field) __atomic_load_n(&(field), __ATOMIC_ACQUIRE)

static void span_position(const struct span *span, uint32_t done, int32_t out[AXIS_COUNT]) {
    uint32_t negative = LOAD(span->negative);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        uint32_t phase = LOAD(span->phase[span_word(ax)]) >> span_shift(ax) & 0xFFFFu;
        uint32_t increment = LOAD(span->increment[span_word(ax)]) >> span_shift(ax) & 0xFFFFu;
        int32_t steps = (int32_t)((phase + done * increment) >> SPAN_PHASE_BITS);
        out[ax] = LOAD(span->position[ax]) + (negative >> ax & 1 ? -steps : steps);
    }
}

void step_probe_position(const struct step *step, int32_t out[AXIS_COUNT]) {
    span_position(&step->probe_span, step->probe_span.events - step->probe_left, out);
}

/* The ISR may end the span between two reads; then its tail has moved, or its count has, and we look again.
 */
void step_position(const struct step *step, const int32_t rest[AXIS_COUNT], int32_t out[AXIS_COUNT]) {
    for (;;) {
        uint32_t tail = LOAD(step->ring.index.tail);
        if (LOAD(step->ring.index.head) == tail) {
            for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
                out[ax] = rest[ax];
            return;
        }
        const struct span *span = &step->ring.slots[tail & (SPAN_RING_SIZE - 1)];
        bool current = LOAD(step->loaded);
        uint32_t left = LOAD(step->events_left);
        span_position(span, current ? LOAD(span->events) - left : 0, out);
        if (LOAD(step->ring.index.tail) == tail && LOAD(step->loaded) == current &&
            LOAD(step->events_left) == left)
            return;
    }
}
