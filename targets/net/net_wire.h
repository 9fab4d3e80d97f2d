/* SPDX-License-Identifier: MIT
 * The sockets of the binary protocol: a UDP port and up to SESSION_CLIENTS TCP connections,
 * around a session. Nothing blocks; no one who does not read or write holds anyone else up. A connection
 * without a message is closed after some seconds, and net_places.h chooses who goes for a newcomer.
 *
 *   datagram -> session_datagram();   u16 size | message -> session_request() -> u16 size | reply */
#ifndef WIFICNC_NET_WIRE_H
#define WIFICNC_NET_WIRE_H

#include "net_stream.h"
#include "session/session.h"

enum { NET_WIRE_OUT = 768 };

struct net_wire_client {
    struct net_stream stream; /* .ops NULL: a free place */
    uint8_t in[2 + WIRE_CONTROL_MAX];
    size_t in_count;
    uint8_t out[NET_WIRE_OUT]; /* replies that wait for the client to read */
    size_t out_count;
    bool spoke;       /* there was a message */
    uint32_t came_us; /* when it connected */
};

struct net_wire {
    int udp, listener; /* -1: closed */
    struct session *session;
    struct net_wire_client client[SESSION_CLIENTS];
};

/** What a session sends goes out here: ops->send of a session whose ctx is a struct net_wire. */
void net_wire_send(void *ctx, const struct session_peer *to, const uint8_t *packet, size_t size);

/** Open both ports. @param address  IPv4, numeric; 0.0.0.0: all, and broadcasts are heard
 *  @return 0 or an error of the system, and then nothing is open */
int net_wire_open(struct net_wire *wire, const char *address, struct session *session);

/** Everyone is disconnected. */
void net_wire_close(struct net_wire *wire);

/** Whether this client's messages may be read; those of one that does not read its replies wait. */
bool net_wire_wants_read(const struct net_wire_client *client);

/** Do what has come, a bounded part of it. Call it when a socket is ready, or every ms. */
void net_wire_round(struct net_wire *wire);

#endif
