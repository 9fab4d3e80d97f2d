/* SPDX-License-Identifier: MIT
 * Receive buffer of one stream: real-time bytes are taken out at once, the others wait for the line reader.
 *
 * rx_put() may run in a receive interrupt or another task than rx_get() (base/ring.h). Every byte >= 0x80 is
 * removed from the stream: known ones act, unknown ones vanish. */
#ifndef WIFICNC_LINK_RX_H
#define WIFICNC_LINK_RX_H

#include "base/ring.h"
#include "config.h"

#include <stdbool.h>
#include <stdint.h>

/** Real-time requests, collected as bits until the machine takes them. */
enum realtime {
    REALTIME_STATUS = 0x01, /* ?    */
    REALTIME_HOLD = 0x02,   /* !    */
    REALTIME_RESUME = 0x04, /* ~    */
    REALTIME_RESET = 0x08,  /* 0x18 */
};

struct rx {
    struct ring index;
    uint32_t realtime; /* enum realtime bits; atomic */
    uint8_t bytes[RX_SIZE];
};

void rx_init(struct rx *rx);

/** [isr or task] Take one byte. @return false: the buffer is full, nothing was changed; the byte must come
 * again. */
bool rx_put(struct rx *rx, uint8_t byte);

/** [task] The oldest byte, or -1. */
int rx_get(struct rx *rx);

/** [task] Real-time requests since the last call. */
uint32_t rx_take_realtime(struct rx *rx);

/** [task] Forget all waiting bytes. */
void rx_flush(struct rx *rx);

/** Bytes that can be put now. */
static inline uint32_t rx_free(const struct rx *rx) {
    return ring_free(&rx->index, RX_SIZE);
}

#endif
