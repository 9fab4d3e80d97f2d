/* SPDX-License-Identifier: MIT */
#include "link/rx.h"

void rx_init(struct rx *rx) {
    rx->index = (struct ring){0, 0};
    rx->realtime = 0;
}

static uint32_t realtime_bit(uint8_t byte) {
    switch (byte) {
    case '?':
        return REALTIME_STATUS;
    case '!':
        return REALTIME_HOLD;
    case '~':
        return REALTIME_RESUME;
    case 0x18:
        return REALTIME_RESET;
    default:
        return 0;
    }
}

bool rx_put(struct rx *rx, uint8_t byte) {
    uint32_t bit = realtime_bit(byte);
    if (bit != 0) {
        __atomic_fetch_or(&rx->realtime, bit, __ATOMIC_RELEASE);
        return true;
    }
    if (byte >= 0x80)
        return true;
    if (ring_free(&rx->index, RX_SIZE) == 0)
        return false;
    rx->bytes[rx->index.head & (RX_SIZE - 1)] = byte;
    ring_push(&rx->index);
    return true;
}

int rx_get(struct rx *rx) {
    if (ring_held(&rx->index) == 0)
        return -1;
    uint8_t byte = rx->bytes[rx->index.tail & (RX_SIZE - 1)];
    ring_pop(&rx->index);
    return byte;
}

uint32_t rx_take_realtime(struct rx *rx) {
    return __atomic_exchange_n(&rx->realtime, 0, __ATOMIC_ACQUIRE);
}

void rx_flush(struct rx *rx) {
    __atomic_store_n(&rx->index.tail, rx->index.head, __ATOMIC_RELEASE);
}
