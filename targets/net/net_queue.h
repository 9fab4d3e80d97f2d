/* SPDX-License-Identifier: MIT
 * Bytes in, bytes out, in order: what waits for a slow reader or a busy controller. Grows as needed; whoever
 * fills it keeps it bounded. */
#ifndef WIFICNC_NET_QUEUE_H
#define WIFICNC_NET_QUEUE_H

#include <stdbool.h>
#include <stddef.h>

/** All zero is an empty queue. */
struct net_queue {
    char *bytes;
    size_t begin, count, size;
};

/** Append. @return false: no memory; nothing was changed. */
bool net_queue_add(struct net_queue *queue, const char *bytes, size_t count);

/** The oldest byte; queue->count follow one another. */
static inline const char *net_queue_head(const struct net_queue *queue) {
    return queue->begin == 0 ? queue->bytes : queue->bytes + queue->begin; /* NULL while nothing was added */
}

/** Forget the oldest `count` bytes. */
void net_queue_drop(struct net_queue *queue, size_t count);

/** Keep only the oldest `count` bytes. */
static inline void net_queue_cut(struct net_queue *queue, size_t count) {
    queue->count = count;
}

/** Empty, and its memory given back. */
void net_queue_free(struct net_queue *queue);

#endif
