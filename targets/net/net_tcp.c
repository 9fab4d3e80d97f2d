/* SPDX-License-Identifier: MIT */
#include "net_tcp.h"

#include "base/lockout.h"

#include <string.h>

static uint64_t half_of(const uint8_t bytes[8]) {
    uint64_t half = 0;
    for (unsigned i = 0; i < 8; i++)
        half = half << 8 | bytes[i];
    return half;
}

/* Of an IPv6 address the network (upper half), because a guesser with one address usually has all of its
 * network; of a link-local address the lower half, because the upper one is the same for all.
 * @param[out] host  the lower half; 0: it is no IPv6 address */
static uint64_t peer_of(const struct net_address *from, uint64_t *host) {
    static const uint8_t mapped[12] = {[10] = 0xFF, [11] = 0xFF}, link_local[2] = {0xFE, 0x80};
    *host = 0;
    if (!from->v6)
        return lockout_ipv4(from->bytes);
    if (memcmp(from->bytes, mapped, sizeof mapped) == 0)
        return lockout_ipv4(from->bytes + sizeof mapped);
    *host = half_of(from->bytes + 8);
    return memcmp(from->bytes, link_local, sizeof link_local) == 0 ? *host : half_of(from->bytes);
}

int net_tcp_listen(const char *host, const char *port, char address[NET_ADDRESS_SIZE], int *error) {
    struct net_address bound = {0};
    int fd = net_socket_listen(host, port, &bound, error);
    if (fd >= 0)
        net_address_text(&bound, address);
    return fd;
}

/* ---- connections ---- */

static long stream_read(const struct net_stream *stream, char *bytes, size_t size) {
    return net_socket_read(stream->fd, bytes, size);
}

static long stream_write(const struct net_stream *stream, const char *bytes, size_t count) {
    return net_socket_write(stream->fd, bytes, count);
}

static void stream_close(const struct net_stream *stream) {
    net_socket_close(stream->fd);
}

bool net_tcp_stream(int fd, struct net_stream *stream) {
    static const struct net_stream_ops ops = {
        .read = stream_read, .write = stream_write, .close = stream_close};
    if (!net_socket_prepare(fd))
        return false;
    *stream = (struct net_stream){.ops = &ops, .fd = fd, .telnet = true};
    return true;
}

bool net_tcp_accept(int listener, struct net_stream *stream, char name[NET_ADDRESS_SIZE]) {
    struct net_address from;
    int fd = net_socket_accept(listener, &from);
    if (fd < 0 || !net_tcp_stream(fd, stream))
        return false;
    net_address_text(&from, name);
    stream->peer = peer_of(&from, &stream->host);
    return true;
}

uint64_t net_tcp_here(const struct net_stream *stream) {
    struct net_address here;
    uint64_t host;
    return net_socket_here(stream->fd, &here) ? peer_of(&here, &host) : 0;
}

/* First asked after so many s of silence, then every so many s, and so often. */
enum { KEEP_IDLE_S = 1, KEEP_EVERY_S = 1, KEEP_COUNT = 3 };

void net_tcp_keep_alive(const struct net_stream *stream) {
    net_socket_keep_alive(stream->fd, KEEP_IDLE_S, KEEP_EVERY_S, KEEP_COUNT);
}
