/* SPDX-License-Identifier: MIT
 * TCP: a listener, and connections as streams. Nothing blocks. */
#ifndef WIFICNC_NET_TCP_H
#define WIFICNC_NET_TCP_H

#include "net_socket.h"
#include "net_stream.h"

/** Listen. @param host  numeric or a name, IPv4 or IPv6
 *  @param port  0: any free one
 *  @param[out] address  "127.0.0.1:2323" or "[::1]:2323", the port that was got
 *  @return the socket, or -1: *error is the system's, or 0 when the host is unknown */
int net_tcp_listen(const char *host, const char *port, char address[NET_ADDRESS_SIZE], int *error);

/** The next connection that waits. @param[out] name  its address
 *  @return true and a stream, or false: none, or it was gone again */
bool net_tcp_accept(int listener, struct net_stream *stream, char name[NET_ADDRESS_SIZE]);

/** Our own address of a connection, as net_stream.peer is the other end's. @return 0: it has gone */
uint64_t net_tcp_here(const struct net_stream *stream);

/** A stream of a socket that is connected. @return false: it is closed now */
bool net_tcp_stream(int fd, struct net_stream *stream);

/** Ask a silent peer for a sign of life, so that one that has gone without a word is noticed: after some 4 s
 * reading its stream fails. */
void net_tcp_keep_alive(const struct net_stream *stream);

#endif
