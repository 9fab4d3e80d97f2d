/* SPDX-License-Identifier: MIT
 * A controller or an I/O module of it, as any host sees it: who it is, whether it is there, its reports and
 * its answers, e-stop and reset. No socket, no HAL, no clock: the caller gives what came and the time, s of
 * any clock that never goes back. */
#ifndef WIFICNC_LINUXCNC_PEER_H
#define WIFICNC_LINUXCNC_PEER_H

#include "control.h"
#include "wire/seal.h"

enum { PEER_WORDS_MAX = 200 }; /* of a line to the operator, with its NUL */

/** The world. `ctx` is handed back. */
struct peer_world {
    void *ctx;
    void (*send_udp)(void *ctx, const uint8_t *packet, size_t size); /* it may be lost */
    void (*send_tcp)(void *ctx, const uint8_t *bytes, size_t size);
    void (*random)(void *ctx, uint8_t *bytes, size_t count); /* unpredictable */
    void (*await_servo)(void *ctx); /* return when the servo thread has just run, or after some 10 ms */
    void (*say)(void *ctx, const char *text); /* a line for the operator */
};

/** What its owner does with it. `owner` is handed back. */
struct peer_owner {
    void *owner;
    /** It has said who it is. @return why that is of no use; NULL: it is fine, the owner may ask for more */
    const char *(*greet)(void *owner, const struct wire_handshake_response *hello);
    void (*answer)(void *owner, const struct control_answer *answer);
    void (*report)(void *owner); /* a status has come; peer->status is the newest */
    void (*datagram)(void *owner, const struct wire_header *header, const uint8_t *payload); /* any other */
};

struct peer {
    struct peer_world world;
    struct peer_owner owner;
    const char *key;  /* of access; "": none */
    struct seal seal; /* of our datagrams, when it knows us */
    double now_s;
    const char *lost; /* why the connection is worth nothing any more; NULL: it is fine */
    struct control control;
    bool is_up;    /* it has said who it is */
    bool is_known; /* `status` is one */
    struct wire_status status;
    uint32_t status_us; /* its clock, of that status ... */
    double status_s;    /* ... and ours, when it came */
    double interval_s;  /* from one to the next, on average */
    double heard_s, pinged_s, registered_s;
    bool was_estop, was_reset; /* as last wanted; what was pressed before the connection is not a reset */
    bool stop_is_unseen;       /* no report has said since that it is in e-stop */
    bool resets;               /* a reset is to come, when the e-stop is over */
    double reset_s, estop_s;   /* when it began to be wanted; when the e-stop was last */
};

/** A TCP connection is there: ask who it is. */
void peer_begin(struct peer *peer, const struct peer_world *world, const struct peer_owner *owner,
                const char *key, double now_s);
/** A datagram of it. */
void peer_hear_udp(struct peer *peer, const uint8_t *packet, size_t size, double now_s);
/** Bytes that came by TCP. */
void peer_hear_tcp(struct peer *peer, const uint8_t *bytes, size_t count, double now_s);
/** Look at the time, ask for a sign of life now and then. @return whether it is up, and not lost */
bool peer_tick(struct peer *peer, double now_s);
/** By so much longer than usual there has been no report, s. */
double peer_blind_s(const struct peer *peer);
/** A request; the answer comes to the owner. */
void peer_ask(struct peer *peer, uint8_t type, const void *payload, size_t size);
/** A datagram. */
void peer_post(struct peer *peer, uint8_t type, const void *payload, size_t size);
/** Have its reports come here: they go to whoever has sent it a datagram in the last hour. Ends any jog;
 * peer_tick() does it until there is a report. */
void peer_register(struct peer *peer);
/** Say a line to the operator. printf's format. */
__attribute__((format(printf, 2, 3))) void peer_say(const struct peer *peer, const char *format, ...);
/** E-stop as long as it is wanted: by datagrams until a report says so, and by a request; a reset when that
 *  begins to be wanted, as soon as the e-stop is over. @return true: it begins to be wanted */
bool peer_stop_and_reset(struct peer *peer, bool estop, bool reset);
/** In an e-stop, or an alarm that a reset ends. */
bool peer_is_locked(const struct peer *peer);
/** Locked since power-on or a reset in motion: its position is not known, and it is to be homed. */
bool peer_awaits_homing(const struct peer *peer);
/** Why something was refused, in words. */
const char *peer_refusal(unsigned refusal);
/** Of a clock that wraps. */
bool peer_is_later(uint32_t one_us, uint32_t other_us);

#endif
