/* SPDX-License-Identifier: MIT
 * The sockets to one controller. None of them ever blocks. */
#ifndef WIFICNC_LINUXCNC_NETWORK_H
#define WIFICNC_LINUXCNC_NETWORK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct network {
    int tcp, udp, status; /* -1: none */
};

/** Take what comes: a whole datagram, or some bytes of TCP. */
typedef void (*network_taker)(void *ctx, const uint8_t *bytes, size_t count);

/** Whether this is an IPv4 address, as text. */
bool network_is_address(const char *address);
/** Open all of them; TCP begins to connect.
 *  @param address  one of these
 *  @return NULL, or what is wrong; nothing is open then */
const char *network_open(struct network *network, const char *address);
/** Whether TCP is connected. @param[out] wrong  why it never will be; else untouched */
bool network_is_connected(const struct network *network, const char **wrong);
/** Give all datagrams and bytes that have come.
 *  @return NULL, or why the connection is worth nothing any more */
const char *network_receive(const struct network *network, network_taker udp, network_taker tcp, void *ctx);
/** A datagram; what does not get out is lost, as others are on their way. */
void network_send_udp(const struct network *network, const uint8_t *bytes, size_t count);
/** @return false: the controller does not take it */
bool network_send_tcp(const struct network *network, const uint8_t *bytes, size_t count);
/** Wait until something comes, at most this long. */
void network_wait(const struct network *network, double seconds);
void network_close(struct network *network);

#endif
