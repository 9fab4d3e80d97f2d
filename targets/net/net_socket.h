/* SPDX-License-Identifier: MIT
 * Sockets of every system, by the numbers that it gives them; -1 is none. Nothing blocks. */
#ifndef WIFICNC_NET_SOCKET_H
#define WIFICNC_NET_SOCKET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { NET_ADDRESS_SIZE = 64 };

enum { NET_NOTHING = -6 }; /* no datagram waits; next to those of net_stream.h */

struct net_address {
    bool v6;
    uint8_t bytes[16]; /* IPv4: the first four */
    uint16_t port;
};

/** "127.0.0.1:2323" or "[::1]:2323". */
void net_address_text(const struct net_address *address, char out[NET_ADDRESS_SIZE]);

/** @param text  IPv4, numeric @return false: it is not */
bool net_address_v4(const char *text, uint16_t port, struct net_address *out);

/** Listen for TCP. @param host  numeric or a name, IPv4 or IPv6; NULL: all networks
 *  @param port  0: any free one
 *  @param[out] bound  the address that was got
 *  @return the socket, or -1: *error is the system's, or 0 when the host is unknown */
int net_socket_listen(const char *host, const char *port, struct net_address *bound, int *error);

/** The next connection that waits. @return the socket, or -1: none, or it was gone again */
int net_socket_accept(int listener, struct net_address *from);

/** A connection's other end. @return false: it has gone */
bool net_socket_peer(int fd, struct net_address *out);

/** A connection's own end. @return false: it has gone */
bool net_socket_here(int fd, struct net_address *out);

/** Make a connection one that does not block, and whose short answers do not wait for more.
 *  @return false: it is closed now */
bool net_socket_prepare(int fd);

/** Notice a peer that has gone without a word: it is asked after idle_s of silence, every every_s, so often.
 */
void net_socket_keep_alive(int fd, int idle_s, int every_s, int count);

/** As of net_stream_ops. */
long net_socket_read(int fd, char *bytes, size_t size);
long net_socket_write(int fd, const char *bytes, size_t count);
void net_socket_close(int fd);

/* ---- datagrams ---- */

/** @param here  IPv4 @param shared  other programs may use this port too
 *  @return the socket, or -1: *error is the system's */
int net_socket_udp(const struct net_address *here, bool shared, int *error);

/** From now on the system tells of datagrams that have reached no program: net_socket_unreachable(). Where it
 * does not (all but Linux), they are lost without a word. */
void net_socket_watch_unreachable(int fd);

/** The next datagram of this socket that an ICMP "destination unreachable" has answered. Anyone can forge
 * one.
 * @param[out] to  where it went @return false: no more */
bool net_socket_unreachable(int fd, struct net_address *to);

/** Become a member of an IPv4 group, by the interface with this address, and send to groups by it. */
void net_socket_join(int fd, const struct net_address *group, const uint8_t interface[4]);

/** Send a datagram, which may be lost. */
void net_socket_send(int fd, const struct net_address *to, const uint8_t *bytes, size_t count);

/** @return bytes; NET_NOTHING; NET_GONE: an error, mostly of someone who does not listen any more */
long net_socket_receive(int fd, uint8_t *bytes, size_t size, struct net_address *from);

#endif
