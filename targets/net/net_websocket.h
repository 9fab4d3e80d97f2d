/* SPDX-License-Identifier: MIT
 * A WebSocket (RFC 6455) as a byte stream: Grbl's bytes for a browser. [task] The server's side, over any
 * other stream; nothing blocks.
 *
 * In: messages of any length and in any pieces are one stream of bytes. A binary message is taken as it is. A
 * text message is UTF-8, in which the jog cancel 0x85 is C2 85: U+0080 .. U+00A1, Grbl's real-time
 * characters, become single bytes, and other characters beyond ASCII are left out. Pings are answered. What
 * is not a WebSocket ends the connection, with the reason in the close frame. Out: binary messages. */
#ifndef WIFICNC_NET_WEBSOCKET_H
#define WIFICNC_NET_WEBSOCKET_H

#include "net_stream.h"

#include <stdint.h>

enum { NET_WEBSOCKET_ACCEPT_SIZE = 29, NET_WEBSOCKET_KEY_SIZE = 24, NET_WEBSOCKET_CONTROL_MAX = 125 };

/** What the server must answer to the client's Sec-WebSocket-Key.
 *  @param key  NET_WEBSOCKET_KEY_SIZE characters
 *  @param[out] accept  NUL-terminated */
void net_websocket_accept(const char *key, char accept[NET_WEBSOCKET_ACCEPT_SIZE]);

struct net_websocket {
    struct net_stream inner; /* the connection, behind its handshake */
    /* the frame that is being read */
    uint8_t head[16], head_count;               /* 14 at most */
    uint64_t left;                              /* bytes of its payload to come */
    uint32_t at;                                /* bytes of its payload that came, for the mask */
    uint8_t message;                            /* opcode of the data message that continues, 0: none */
    uint32_t character, character_least;        /* of a text: what came of it; what it must be at least */
    uint8_t continuations;                      /* how many bytes of it are to come */
    uint8_t control[NET_WEBSOCKET_CONTROL_MAX]; /* payload of the ping or close that is being read */
    /* what is being written */
    uint8_t reply[2 + NET_WEBSOCKET_CONTROL_MAX]; /* a pong or close */
    uint8_t reply_count, reply_sent;
    uint8_t out_head[4], out_head_count, out_head_sent;
    uint16_t out_left;             /* bytes of the payload that was announced */
    bool closing;                  /* a close frame goes out, then the end */
    uint8_t close[2], close_count; /* its payload */
    bool close_waits;              /* ... until the rest of a pong is out */
};

/** Make a stream of a connection that has been answered 101. @param websocket  from malloc(); close() frees
 * it
 *  @param[out] stream  .telnet is false */
void net_websocket_open(struct net_websocket *websocket, const struct net_stream *inner,
                        struct net_stream *stream);

#endif
