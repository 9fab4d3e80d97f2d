/* SPDX-License-Identifier: MIT
 * The segment ring: the border between the task side, which plans, and the motion side, which steps.
 *
 * One producer, one consumer, no lock (base/ring.h). Who may produce is written down: the owner changes only
 * while the ring is empty, so segments of the planner and of a network host never mix. */
#ifndef WIFICNC_SEGMENT_RING_H
#define WIFICNC_SEGMENT_RING_H

#include "base/ring.h"
#include "config.h"
#include "segment/segment.h"

#include <stdbool.h>

enum ring_owner { RING_OWNER_NONE, RING_OWNER_PLANNER, RING_OWNER_HOST };

struct segment_ring {
    struct ring index;
    uint32_t pushed_us; /* duration of all segments ever pushed, wraps; written by the producer */
    uint32_t popped_us; /* the same for popped ones; written by the consumer */
    enum ring_owner owner;
    struct segment slots[SEGMENT_RING_SIZE];
};

/** [task] Empty, without owner. Not while the motion side runs. */
void segment_ring_init(struct segment_ring *ring);

/** [task] Take the ring, or give it back with RING_OWNER_NONE. @return false: another owner still has
 * segments in it. */
bool segment_ring_claim(struct segment_ring *ring, enum ring_owner owner);

/** [task, owner] Append a copy. @return false: the ring is full or belongs to someone else; nothing was
 * changed. */
bool segment_ring_push(struct segment_ring *ring, enum ring_owner owner, const struct segment *segment);

/** [task] Motion waiting in the ring, us, at most 2^31. The segment being stepped is not counted. */
static inline uint32_t segment_ring_queued_us(const struct segment_ring *ring) {
    return ring->pushed_us - __atomic_load_n(&ring->popped_us, __ATOMIC_ACQUIRE);
}

/** [motion] The oldest segment, or NULL. It stays in place until segment_ring_pop(). */
static inline const struct segment *segment_ring_peek(const struct segment_ring *ring) {
    if (ring_held(&ring->index) == 0)
        return 0;
    return &ring->slots[ring->index.tail & (SEGMENT_RING_SIZE - 1)];
}

/** [motion] Give the oldest segment's slot back. Only after a peek that found one. */
void segment_ring_pop(struct segment_ring *ring);

#endif
