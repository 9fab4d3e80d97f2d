/* SPDX-License-Identifier: MIT
 * A queue when memory is short: what fits into the bytes that it holds already is taken, and so is what fits
 * into a new piece of just that size; nothing is lost or comes twice. */
#include "check.h"

#include <stdint.h>
#include <stdlib.h>

static size_t largest; /* that there is in one piece */

static void *little_malloc(size_t size) {
    return size <= largest ? malloc(size) : NULL;
}

#define malloc         little_malloc
#define net_queue_add  little_add
#define net_queue_head little_head
#define net_queue_drop little_drop
#define net_queue_cut  little_cut
#define net_queue_free little_free
#include "../../targets/net/net_queue.c"
#undef malloc

static uint8_t put_next, took_next;

static bool put(struct net_queue *queue, size_t count) {
    char bytes[4096];
    for (size_t n = 0; n < count; n++)
        bytes[n] = (char)(uint8_t)(put_next + n);
    const bool taken = net_queue_add(queue, bytes, count);
    put_next = (uint8_t)(put_next + (taken ? count : 0));
    return taken;
}

static bool take(struct net_queue *queue, size_t count) {
    bool right = true;
    for (size_t n = 0; n < count; n++)
        right &= (uint8_t)queue->bytes[queue->begin + n] == (uint8_t)(took_next + n);
    took_next = (uint8_t)(took_next + count);
    net_queue_drop(queue, count);
    return right;
}

/* Answers to $$ wait for 115200 baud: some 12 KB, and the piece that would hold twice that is not there. */
static void what_it_holds_is_enough(void) {
    struct net_queue queue = {0};
    largest = SIZE_MAX;
    for (unsigned n = 0; n < 10; n++)
        CHECK(put(&queue, 1070));
    const size_t size = queue.size;
    largest = size - 1;
    for (unsigned n = 0; n < 10000; n++) {
        const size_t count = 1 + n * 37 % 128;
        while (queue.count + count > size)
            CHECK(take(&queue, 1 + n % 61));
        CHECK(put(&queue, count));
    }
    CHECK(queue.size == size);
    CHECK(take(&queue, queue.count));
    net_queue_free(&queue);
}

static void a_piece_of_just_its_size_is_enough(void) {
    struct net_queue queue = {0};
    largest = 6000;
    for (unsigned n = 0; n < 60; n++)
        CHECK(put(&queue, 100));
    CHECK(!put(&queue, 100));
    CHECK(queue.count == largest);
    CHECK(take(&queue, queue.count));
    net_queue_free(&queue);
}

int main(void) {
    what_it_holds_is_enough();
    a_piece_of_just_its_size_is_enough();
    return report();
}
