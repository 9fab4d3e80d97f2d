/* SPDX-License-Identifier: MIT
 * Two real threads on one segment ring, under ThreadSanitizer: every segment arrives once, whole and in
 * order. */
#include "segment/ring.h"

#include <pthread.h>
#include <sched.h>
#include <stdio.h>

enum { COUNT = 300000 };

static struct segment_ring ring;

static struct segment make(uint32_t n) {
    struct segment segment = {.duration_ns = n + 1, .line = ~n, .id = (uint16_t)n};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        segment.steps[ax] = (int16_t)(n * (ax + 1));
    return segment;
}

static void *produce(void *unused) {
    (void)unused;
    for (uint32_t n = 0; n < COUNT;) {
        struct segment segment = make(n);
        if (segment_ring_push(&ring, RING_OWNER_PLANNER, &segment))
            n++;
        else
            sched_yield();
    }
    return NULL;
}

int main(void) {
    pthread_t producer;
    uint32_t wrong = 0;
    segment_ring_init(&ring);
    if (!segment_ring_claim(&ring, RING_OWNER_PLANNER) || pthread_create(&producer, NULL, produce, NULL) != 0)
        return 2;
    for (uint32_t n = 0; n < COUNT;) {
        const struct segment *segment = segment_ring_peek(&ring);
        if (segment == NULL) {
            sched_yield();
            continue;
        }
        wrong +=
            segment->line != ~n || segment->duration_ns != n + 1 || segment->steps[5] != (int16_t)(n * 6);
        segment_ring_pop(&ring);
        n++;
    }
    pthread_join(producer, NULL);
    printf("%u wrong, %u us left\n", wrong, segment_ring_queued_us(&ring));
    return wrong == 0 && segment_ring_queued_us(&ring) == 0 ? 0 : 1;
}
