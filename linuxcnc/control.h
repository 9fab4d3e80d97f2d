/* SPDX-License-Identifier: MIT
 * The TCP side of a controller: requests, answered in their order. Nothing waits here: what was asked is
 * remembered, and the answer is looked at when it has come. No socket; times are s of any clock that never
 * goes back. */
#ifndef WIFICNC_LINUXCNC_CONTROL_H
#define WIFICNC_LINUXCNC_CONTROL_H

#include "wire/packet.h"

enum {
    CONTROL_WAITING = 32,   /* requests at the same time */
    CONTROL_SIZE_BYTES = 2, /* before each packet on TCP: its length */
    CONTROL_MESSAGE_MAX = CONTROL_SIZE_BYTES + WIRE_PACKET_MAX,
};

struct control {
    uint32_t sequence; /* of the newest packet, also by UDP */
    unsigned first, waiting;
    struct control_request {
        uint32_t sequence;
        uint8_t type;
        double asked_s;
    } request[CONTROL_WAITING]; /* a ring, oldest at `first` */
    size_t received;
    uint8_t bytes[CONTROL_MESSAGE_MAX]; /* begin of the message that comes in */
};

/** Log to a request. */
struct control_answer {
    uint8_t request; /* its type */
    uint8_t type;    /* WIRE_ACK, WIRE_REFUSED or the reply of that request */
    struct wire_header header;
    const uint8_t *payload; /* long enough for its type; until the next byte is given */
};

/** How it is with the bytes that came. */
enum control_heard { CONTROL_MORE, CONTROL_ANSWER, CONTROL_NONSENSE };

/** A packet with the next sequence number. @param packet  room for WIRE_PACKET_MAX. @return its size, bytes
 */
size_t control_pack(struct control *control, uint8_t *packet, uint8_t type, const void *payload, size_t size,
                    double now_s);
/** A request as bytes for TCP.
 *  @param message  room for CONTROL_MESSAGE_MAX
 *  @return their number; 0: CONTROL_WAITING are not answered */
size_t control_ask(struct control *control, uint8_t *message, uint8_t type, const void *payload, size_t size,
                   double now_s);
/** Bytes that came by TCP, up to the end of an answer.
 *  @param[in,out] bytes  goes behind what was taken
 *  @return CONTROL_ANSWER: *answer is one, call again for the rest; CONTROL_MORE: all was taken;
 * CONTROL_NONSENSE: this is not an answer to the request: the connection is useless */
enum control_heard control_hear(struct control *control, const uint8_t **bytes, size_t *count,
                                struct control_answer *answer);
/** For how long the oldest request has not been answered, s. */
double control_silence_s(const struct control *control, double now_s);

#endif
