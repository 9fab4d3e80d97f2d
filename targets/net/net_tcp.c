/* SPDX-License-Identifier: MIT */
#include "net_tcp.h"

#include "base/lockout.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { BACKLOG = 64 };

static bool would_block(void) {
    return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

static bool make_nonblocking(int fd) {
    int flags = fcntl(fd, F_GETFL);
    (void)fcntl(fd, F_SETFD, FD_CLOEXEC); /* unknown where there are no processes */
    return flags >= 0 && fcntl(fd, F_SETFL, flags | O_NONBLOCK) == 0;
}

static void address_text(const struct sockaddr_storage *from, char out[NET_ADDRESS_SIZE]) {
    char host[INET6_ADDRSTRLEN] = "?";
    if (from->ss_family == AF_INET6) {
        struct sockaddr_in6 v6;
        memcpy(&v6, from, sizeof v6);
        (void)inet_ntop(AF_INET6, &v6.sin6_addr, host, sizeof host);
        snprintf(out, NET_ADDRESS_SIZE, "[%s]:%u", host, (unsigned)ntohs(v6.sin6_port));
    } else {
        struct sockaddr_in v4;
        memcpy(&v4, from, sizeof v4);
        (void)inet_ntop(AF_INET, &v4.sin_addr, host, sizeof host);
        snprintf(out, NET_ADDRESS_SIZE, "%s:%u", host, (unsigned)ntohs(v4.sin_port));
    }
}

/* Of an IPv6 address the network, for whoever has one has all its addresses; on the link, where there is only
 * one network, the rest. */
static uint64_t peer_of(const struct sockaddr_storage *from) {
    static const uint8_t mapped[12] = {[10] = 0xFF, [11] = 0xFF}, link_local[2] = {0xFE, 0x80};
    uint8_t bytes[16] = {0};
    uint64_t peer = 0;
    if (from->ss_family == AF_INET6) {
        struct sockaddr_in6 v6;
        memcpy(&v6, from, sizeof v6);
        memcpy(bytes, &v6.sin6_addr, sizeof bytes);
    } else {
        struct sockaddr_in v4;
        memcpy(&v4, from, sizeof v4);
        memcpy(bytes, mapped, sizeof mapped);
        memcpy(bytes + sizeof mapped, &v4.sin_addr, 4);
    }
    if (memcmp(bytes, mapped, sizeof mapped) == 0)
        return lockout_ipv4(bytes + sizeof mapped);
    const uint8_t *half = memcmp(bytes, link_local, sizeof link_local) == 0 ? bytes + 8 : bytes;
    for (unsigned i = 0; i < 8; i++)
        peer = peer << 8 | half[i];
    return peer;
}

/* A socket that listens, or -1 and errno. */
static int listen_at(const struct addrinfo *at) {
    const int on = 1;
    int fd = socket(at->ai_family, at->ai_socktype, at->ai_protocol);
    if (fd < 0)
        return -1;
    setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on,
               sizeof on); /* a restart need not wait for old connections */
    if (make_nonblocking(fd) && bind(fd, at->ai_addr, at->ai_addrlen) == 0 && listen(fd, BACKLOG) == 0)
        return fd;
    int error = errno;
    close(fd);
    errno = error;
    return -1;
}

int net_tcp_listen(const char *host, const char *port, char address[NET_ADDRESS_SIZE], int *error) {
    const struct addrinfo wanted = {.ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE};
    struct addrinfo *found;
    *error = 0;
    if (getaddrinfo(host, port, &wanted, &found) != 0)
        return -1;
    int fd = -1;
    for (const struct addrinfo *at = found; at != NULL && fd < 0; at = at->ai_next)
        fd = listen_at(at);
    *error = errno;
    freeaddrinfo(found);
    struct sockaddr_storage bound;
    socklen_t size = sizeof bound;
    if (fd >= 0 && getsockname(fd, (struct sockaddr *)&bound, &size) == 0)
        address_text(&bound, address);
    return fd;
}

/* ---- connections ---- */

static long stream_read(const struct net_stream *stream, char *bytes, size_t size) {
    ssize_t count = recv(stream->fd, bytes, size, 0);
    if (count > 0)
        return (long)count;
    if (count == 0)
        return NET_ENDED;
    return would_block() ? 0 : NET_GONE;
}

static long stream_write(const struct net_stream *stream, const char *bytes, size_t count) {
    ssize_t taken = send(stream->fd, bytes, count, 0);
    if (taken >= 0)
        return (long)taken;
    return would_block() ? 0 : NET_GONE;
}

static void stream_close(const struct net_stream *stream) {
    close(stream->fd);
}

bool net_tcp_stream(int fd, struct net_stream *stream) {
    static const struct net_stream_ops ops = {
        .read = stream_read, .write = stream_write, .close = stream_close};
    const int on = 1;
    if (!make_nonblocking(fd)) {
        close(fd);
        return false;
    }
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on); /* an ok waits for nobody */
    *stream = (struct net_stream){.ops = &ops, .fd = fd, .telnet = true};
    return true;
}

bool net_tcp_accept(int listener, struct net_stream *stream, char name[NET_ADDRESS_SIZE]) {
    struct sockaddr_storage from;
    socklen_t size = sizeof from;
    int fd = accept(listener, (struct sockaddr *)&from, &size);
    if (fd < 0 || !net_tcp_stream(fd, stream))
        return false;
    address_text(&from, name);
    stream->peer = peer_of(&from);
    return true;
}

/* First asked after so many s of silence, then every so many s, and so often. */
enum { KEEP_IDLE_S = 1, KEEP_EVERY_S = 1, KEEP_COUNT = 3 };

void net_tcp_keep_alive(const struct net_stream *stream) {
    const int on = 1;
    setsockopt(stream->fd, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
#ifdef TCP_KEEPIDLE /* not on every system */
    const int idle_s = KEEP_IDLE_S, every_s = KEEP_EVERY_S, count = KEEP_COUNT;
    setsockopt(stream->fd, IPPROTO_TCP, TCP_KEEPIDLE, &idle_s, sizeof idle_s);
    setsockopt(stream->fd, IPPROTO_TCP, TCP_KEEPINTVL, &every_s, sizeof every_s);
    setsockopt(stream->fd, IPPROTO_TCP, TCP_KEEPCNT, &count, sizeof count);
#endif
}
