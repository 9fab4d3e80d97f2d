/* SPDX-License-Identifier: MIT
 * The sending end of a stream: every segment gets there once, whatever the network does. No socket; times are
 * s of any clock that never goes back. docs/protocol.md describes streams. */
#ifndef WIFICNC_LINUXCNC_SENDER_H
#define WIFICNC_LINUXCNC_SENDER_H

#include "wire/wire_gen.h"

#include <stdbool.h>
#include <stddef.h>

enum {
    SENDER_SIZE = 512, /* segments that may wait for the controller; a power of two */
    SENDER_PAYLOAD_MAX = WIRE_STREAM_SEGMENTS_SIZE + WIRE_MOTION_SEGMENTS_MAX * WIRE_SEGMENT_SIZE,
};

struct sender {
    uint32_t stream;
    uint32_t next;      /* all segments before it are with the controller */
    uint32_t done;      /* all before it are executed */
    uint32_t posted;    /* all before it were sent once at least */
    uint32_t end;       /* segments put so far */
    uint32_t limit;     /* segments before it have room there */
    uint32_t underruns; /* as the controller counts them */
    uint32_t sent;      /* datagrams */
    double last_s;      /* when the newest of them was made */
    struct sender_place {
        struct wire_segment segment;
        double sent_s;
        bool taken; /* before those in front of it */
    } place[SENDER_SIZE];
};

/** @param capacity  segments that the controller takes before it says more */
void sender_begin(struct sender *sender, uint32_t stream, uint32_t capacity);
/** Append a segment. @return false: SENDER_SIZE of them wait, so the controller has not answered for long */
bool sender_put(struct sender *sender, const struct wire_segment *segment);
/** A datagram to send now. Call it until there is none.
 *  @param[out] payload  of WIRE_STREAM_SEGMENTS
 *  @return its size, bytes; 0: nothing to send */
size_t sender_poll(struct sender *sender, double now_s, uint8_t payload[SENDER_PAYLOAD_MAX]);
/** An answer. Those of other streams, and those that cannot be, are left out. @return whether it is one of
 * this stream */
bool sender_take(struct sender *sender, const struct wire_stream_ack *ack);

static inline bool sender_is_executed(const struct sender *sender) {
    return sender->done == sender->end;
}

#endif
