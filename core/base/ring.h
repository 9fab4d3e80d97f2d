/* SPDX-License-Identifier: MIT
 * Indices of a single-producer, single-consumer ring, shared by two cores or by a task and an ISR without a
 * lock.
 *
 *   slot:      0   1   2   3   4   5   6   7          size 8, a power of two
 *                      ^tail           ^head          held: 2 3 4 5
 *
 * head counts slots ever filled, tail slots ever emptied; both wrap at 2^32 and only their difference counts,
 * so all `size` slots are usable. Only the producer writes head, only the consumer writes tail. The producer
 * fills the slot, then publishes head with release; the consumer reads head with acquire, so it sees the
 * slot's contents; the same the other way round for tail. */
#ifndef WIFICNC_BASE_RING_H
#define WIFICNC_BASE_RING_H

#include <stdint.h>

struct ring {
    uint32_t head; /* written by the producer */
    uint32_t tail; /* written by the consumer */
};

/** [producer] Free slots; may grow at any moment. */
static inline uint32_t ring_free(const struct ring *ring, uint32_t size) {
    return size -
           (__atomic_load_n(&ring->head, __ATOMIC_RELAXED) - __atomic_load_n(&ring->tail, __ATOMIC_ACQUIRE));
}

/** [consumer] Held slots; may grow at any moment. */
static inline uint32_t ring_held(const struct ring *ring) {
    return __atomic_load_n(&ring->head, __ATOMIC_ACQUIRE) - __atomic_load_n(&ring->tail, __ATOMIC_RELAXED);
}

/** [producer] Publish the slot at head. */
static inline void ring_push(struct ring *ring) {
    __atomic_store_n(&ring->head, __atomic_load_n(&ring->head, __ATOMIC_RELAXED) + 1, __ATOMIC_RELEASE);
}

/** [consumer] Give the slot at tail back. @return slots held, as ring_held() */
static inline uint32_t ring_pop(struct ring *ring) {
    uint32_t tail = __atomic_load_n(&ring->tail, __ATOMIC_RELAXED) + 1;
    __atomic_store_n(&ring->tail, tail, __ATOMIC_RELEASE);
    return __atomic_load_n(&ring->head, __ATOMIC_ACQUIRE) - tail;
}

#endif
