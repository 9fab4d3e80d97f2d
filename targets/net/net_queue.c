/* SPDX-License-Identifier: MIT */
#include "net_queue.h"

#include <stdlib.h>
#include <string.h>

enum { SMALLEST = 256 };

static bool move_to(struct net_queue *queue, size_t size) {
    char *bytes = malloc(size);
    if (bytes == NULL)
        return false;
    if (queue->count > 0)
        memcpy(bytes, queue->bytes + queue->begin, queue->count);
    free(queue->bytes);
    *queue = (struct net_queue){.bytes = bytes, .count = queue->count, .size = size};
    return true;
}

/* Room for `count` more behind what is there. */
static bool make_room(struct net_queue *queue, size_t count) {
    size_t needed = queue->count + count;
    if (queue->begin + needed <= queue->size)
        return true;
    /* Moving pays: at least half of it is free afterwards. Else twice what is needed, so that the next lines
     * find room without another copy. */
    if (needed > queue->size / 2 && move_to(queue, 2 * needed < SMALLEST ? SMALLEST : 2 * needed))
        return true;
    if (needed > queue->size) /* memory is short */
        return move_to(queue, needed);
    memmove(queue->bytes, queue->bytes + queue->begin, queue->count);
    queue->begin = 0;
    return true;
}

bool net_queue_add(struct net_queue *queue, const char *bytes, size_t count) {
    if (!make_room(queue, count))
        return false;
    if (count > 0)
        memcpy(queue->bytes + queue->begin + queue->count, bytes, count);
    queue->count += count;
    return true;
}

void net_queue_drop(struct net_queue *queue, size_t count) {
    queue->count -= count;
    queue->begin = queue->count == 0 ? 0 : queue->begin + count;
}

void net_queue_free(struct net_queue *queue) {
    free(queue->bytes);
    *queue = (struct net_queue){0};
}
