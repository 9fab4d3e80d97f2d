/* SPDX-License-Identifier: MIT
 * Position in closed form from the span being stepped: no counter can ever differ from the pulses. */
#include "step/isr.h"

static void span_position(const struct span *span, uint32_t done, int32_t out[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        uint32_t phase = span->phase[span_word(ax)] >> span_shift(ax) & 0xFFFFu;
        uint32_t increment = span->increment[span_word(ax)] >> span_shift(ax) & 0xFFFFu;
        int32_t steps = (int32_t)((phase + done * increment) >> SPAN_PHASE_BITS);
        out[ax] = span->position[ax] + (span->negative >> ax & 1 ? -steps : steps);
    }
}

/* The ISR may end the span between two reads; then its tail has moved, or its count has, and we look again.
 */
void step_position(const struct step *step, const int32_t rest[AXIS_COUNT], int32_t out[AXIS_COUNT]) {
    const volatile uint32_t *left = &step->events_left;
    const volatile bool *loaded = &step->loaded;
    for (;;) {
        uint32_t tail = __atomic_load_n(&step->ring.index.tail, __ATOMIC_ACQUIRE);
        if (__atomic_load_n(&step->ring.index.head, __ATOMIC_ACQUIRE) == tail) {
            for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
                out[ax] = rest[ax];
            return;
        }
        const struct span *span = &step->ring.slots[tail & (SPAN_RING_SIZE - 1)];
        bool current = *loaded;
        uint32_t events_left = *left;
        span_position(span, current ? span->events - events_left : 0, out);
        __atomic_thread_fence(__ATOMIC_ACQUIRE);
        if (__atomic_load_n(&step->ring.index.tail, __ATOMIC_ACQUIRE) == tail && *loaded == current &&
            *left == events_left)
            return;
    }
}
