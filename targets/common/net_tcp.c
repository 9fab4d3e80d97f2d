/* SPDX-License-Identifier: MIT */
#include "net_tcp.h"

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
    return flags >= 0 && fcntl(fd, F_SETFL, flags | O_NONBLOCK) == 0 && fcntl(fd, F_SETFD, FD_CLOEXEC) == 0;
}

static void address_text(const struct sockaddr *from, socklen_t size, char out[NET_ADDRESS_SIZE]) {
    char host[NET_ADDRESS_SIZE - 10], port[8];
    if (getnameinfo(from, size, host, sizeof host, port, sizeof port, NI_NUMERICHOST | NI_NUMERICSERV) != 0) {
        strcpy(out, "?");
        return;
    }
    bool v6 = strchr(host, ':') != NULL;
    snprintf(out, NET_ADDRESS_SIZE, v6 ? "[%s]:%s" : "%s:%s", host, port);
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
        address_text((const struct sockaddr *)&bound, size, address);
    return fd;
}

/* ---- connections ---- */

static long tcp_read(const struct net_stream *stream, char *bytes, size_t size) {
    ssize_t count = recv(stream->fd, bytes, size, 0);
    if (count > 0)
        return (long)count;
    if (count == 0)
        return NET_ENDED;
    return would_block() ? 0 : NET_GONE;
}

static long tcp_write(const struct net_stream *stream, const char *bytes, size_t count) {
    ssize_t taken = send(stream->fd, bytes, count, 0);
    if (taken >= 0)
        return (long)taken;
    return would_block() ? 0 : NET_GONE;
}

static void tcp_close(const struct net_stream *stream) {
    close(stream->fd);
}

bool net_tcp_accept(int listener, struct net_stream *stream, char name[NET_ADDRESS_SIZE]) {
    static const struct net_stream_ops ops = {.read = tcp_read, .write = tcp_write, .close = tcp_close};
    const int on = 1;
    struct sockaddr_storage from;
    socklen_t size = sizeof from;
    int fd = accept(listener, (struct sockaddr *)&from, &size);
    if (fd < 0)
        return false;
    if (!make_nonblocking(fd)) {
        close(fd);
        return false;
    }
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on); /* an ok waits for nobody */
    address_text((const struct sockaddr *)&from, size, name);
    *stream = (struct net_stream){.ops = &ops, .fd = fd, .telnet = true};
    return true;
}
