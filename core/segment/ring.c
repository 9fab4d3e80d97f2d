/* SPDX-License-Identifier: MIT */
#include "segment/ring.h"

void segment_ring_init(struct segment_ring *ring) {
    ring->index = (struct ring){0, 0};
    ring->pushed_us = ring->popped_us = 0;
    ring->owner = RING_OWNER_NONE;
}

bool segment_ring_claim(struct segment_ring *ring, enum ring_owner owner) {
    if (ring->owner == owner)
        return true;
    if (ring_free(&ring->index, SEGMENT_RING_SIZE) != SEGMENT_RING_SIZE)
        return false;
    ring->owner = owner;
    return true;
}

bool segment_ring_push(struct segment_ring *ring, enum ring_owner owner, const struct segment *segment) {
    if (ring->owner != owner || ring_free(&ring->index, SEGMENT_RING_SIZE) == 0)
        return false;
    ring->slots[ring->index.head & (SEGMENT_RING_SIZE - 1)] = *segment;
    ring->pushed_us += segment->duration_ns / 1000;
    ring_push(&ring->index);
    return true;
}

void segment_ring_pop(struct segment_ring *ring) {
    const struct segment *segment = &ring->slots[ring->index.tail & (SEGMENT_RING_SIZE - 1)];
    __atomic_store_n(&ring->popped_us, ring->popped_us + segment->duration_ns / 1000, __ATOMIC_RELEASE);
    ring_pop(&ring->index);
}
