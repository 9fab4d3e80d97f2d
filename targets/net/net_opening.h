/* SPDX-License-Identifier: MIT
 * The first bytes of a connection to a port of lines: whether they are lines, or a browser's. [task] Pure.
 *
 * A web page can make its visitor's browser send a request to any address and port, with lines of the page's
 * choice in it. So a connection that begins with a request of HTTP is none of a sender, nor is one that
 * begins with TLS (https) or STUN (WebRTC). */
#ifndef WIFICNC_NET_OPENING_H
#define WIFICNC_NET_OPENING_H

#include <stdint.h>

enum { NET_OPENING_HELD = 24 };

enum net_opening_is {
    NET_OPENING_MORE,   /* not known yet: the byte is held */
    NET_OPENING_LINES,  /* what is held and this byte are a sender's */
    NET_OPENING_HTTP,   /* a request: nothing of this connection may be executed */
    NET_OPENING_FOREIGN /* another protocol: as HTTP, but who speaks it reads no text */
};

/** All zero is a connection's begin. */
struct net_opening {
    char held[NET_OPENING_HELD];
    uint8_t count;
};

/** The next byte, until the answer is not NET_OPENING_MORE. */
enum net_opening_is net_opening_take(struct net_opening *opening, uint8_t byte);

#endif
