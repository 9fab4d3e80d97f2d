/* SPDX-License-Identifier: MIT
 * The first bytes of a connection to a port of lines: whether they are lines, or a browser's. [task] Pure.
 *
 * A web page can make its visitor's browser send a request to any address and port, with lines of the page's
 * choice in it. So a connection that begins with a request of HTTP is none of a sender, nor is one that
 * begins with TLS (https) or STUN (WebRTC). */
#ifndef WIFICNC_NET_OPENING_H
#define WIFICNC_NET_OPENING_H

#include <stddef.h>
#include <stdint.h>

enum net_opening_is {
    NET_OPENING_MORE,   /* not known yet: the byte is to be held */
    NET_OPENING_LINES,  /* what is held and this byte are a sender's */
    NET_OPENING_HTTP,   /* a request: nothing of this connection may be executed */
    NET_OPENING_FOREIGN /* another protocol: as HTTP, but who speaks it reads no text */
};

/** The next byte, until the answer is not NET_OPENING_MORE. @param held  all before it; at most 25 bytes */
enum net_opening_is net_opening_take(const char *held, size_t count, uint8_t byte);

#endif
