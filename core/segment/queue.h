/* SPDX-License-Identifier: MIT
 * The segment queue: the border between the task side, which plans, and the motion side, which steps.
 *
 * Segments cross it in batches, one at a time. A batch says after which mark of the motion published before
 * it continues, and it always ends at rest:
 *
 *     published before    c c M c c M | s s s s R        c: committed, s: the stop after it, R: at rest
 *     this batch                    '-> c c M c c M | s s s s s R
 *
 * The motion side takes all of it or nothing. It refuses a batch whose mark the step ISR has already passed;
 * then what was published before stays in force, which is legal motion up to its rest.
 *
 * Ownership: the producer writes slots, count and from while nothing is pending, and hands them over with
 * `published` (release). The motion side reads them after it has seen that (acquire), and gives them back
 * with `answered` (release). The ISR touches none of it. */
#ifndef WIFICNC_SEGMENT_QUEUE_H
#define WIFICNC_SEGMENT_QUEUE_H

#include "config.h"
#include "segment/segment.h"

#include <stdbool.h>

enum queue_answer {
    QUEUE_TAKEN,
    QUEUE_PASSED, /* the step ISR has continued along the motion before */
    QUEUE_LARGE,  /* the spans do not suffice */
};

/** Places for marks. The producer says which one a mark takes, and gives it to another mark only when motion
 * cannot branch off there any more. */
#define QUEUE_MARKS 28u

/** Changes of a laser's S within the segments of a batch. */
#define QUEUE_POWER 160u

/** Place of the mark where motion was reset. */
#define QUEUE_RESET_MARK 0u

struct segment_queue {
    uint32_t published;       /* batches ever; written by the producer */
    uint32_t answered;        /* the same; written by the motion side */
    enum queue_answer answer; /* of the newest one */
    uint32_t now_us; /* motion time at the end of the segment being stepped; written by the motion side */
    uint32_t count;  /* segments of the batch ... */
    uint32_t tail;   /* ... of which so many, its last ones, happen only if a task is late */
    uint32_t from;   /* place of the mark after which it continues */
    struct segment slots[SEGMENT_QUEUE_SIZE];
    uint32_t power_count; /* in use of: */
    struct segment_power power[QUEUE_POWER];
};

_Static_assert(QUEUE_POWER <= UINT8_MAX && QUEUE_MARKS <= UINT8_MAX, "bytes of a segment");

/** A batch waits for its answer. [any] */
static inline bool segment_queue_is_pending(const struct segment_queue *queue) {
    return __atomic_load_n(&queue->published, __ATOMIC_ACQUIRE) !=
           __atomic_load_n(&queue->answered, __ATOMIC_ACQUIRE);
}

/** [task] Hand the batch over; nothing was pending. */
static inline void segment_queue_publish(struct segment_queue *queue) {
    __atomic_store_n(&queue->published, queue->published + 1, __ATOMIC_RELEASE);
}

/** [motion] Return it to the producer. */
static inline void segment_queue_answer(struct segment_queue *queue, enum queue_answer answer) {
    queue->answer = answer;
    __atomic_store_n(&queue->answered, queue->answered + 1, __ATOMIC_RELEASE);
}

/** [any] Motion time at the end of the segment being stepped, or of the last one. */
static inline uint32_t segment_queue_now_us(const struct segment_queue *queue) {
    return __atomic_load_n(&queue->now_us, __ATOMIC_RELAXED);
}

#endif
