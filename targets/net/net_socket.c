/* SPDX-License-Identifier: MIT */
#include "net_socket.h"

#include "net_stream.h"
#include "net_system.h"

#include <stdio.h>
#include <string.h>

enum { BACKLOG = 64, ERRORS_A_CALL = 16 };

/* A socket without the option still works, so a failure is not reported. */
static void set_option(int fd, int level, int name, int value) {
    (void)setsockopt((system_socket)fd, level, name, (const char *)&value, sizeof value);
}

/* ---- addresses ---- */

/* Copied, because C does not allow a sockaddr_storage to be read as another structure. */
static void from_system(const struct sockaddr_storage *from, struct net_address *out) {
    *out = (struct net_address){.v6 = from->ss_family == AF_INET6};
    if (out->v6) {
        struct sockaddr_in6 v6;
        memcpy(&v6, from, sizeof v6);
        memcpy(out->bytes, &v6.sin6_addr, sizeof out->bytes);
        out->port = ntohs(v6.sin6_port);
    } else {
        struct sockaddr_in v4;
        memcpy(&v4, from, sizeof v4);
        memcpy(out->bytes, &v4.sin_addr, 4);
        out->port = ntohs(v4.sin_port);
    }
}

static struct sockaddr_in to_system(const struct net_address *address) {
    struct sockaddr_in v4 = {.sin_family = AF_INET, .sin_port = htons(address->port)};
    memcpy(&v4.sin_addr, address->bytes, 4);
    return v4;
}

void net_address_text(const struct net_address *address, char out[NET_ADDRESS_SIZE]) {
    char host[INET6_ADDRSTRLEN] = "?";
    (void)inet_ntop(address->v6 ? AF_INET6 : AF_INET, address->bytes, host, sizeof host);
    snprintf(out, NET_ADDRESS_SIZE, address->v6 ? "[%s]:%u" : "%s:%u", host, (unsigned)address->port);
}

bool net_address_v4(const char *text, uint16_t port, struct net_address *out) {
    *out = (struct net_address){.port = port};
    return inet_pton(AF_INET, text, out->bytes) == 1;
}

/* ---- TCP ---- */

/* A socket that listens, or -1 and the system's error. */
static int listen_at(const struct addrinfo *at) {
    int fd = (int)socket(at->ai_family, at->ai_socktype, at->ai_protocol);
    if (fd < 0)
        return -1;
    set_option(fd, SOL_SOCKET, SYSTEM_LISTEN_OPTION, 1);
    if (system_unblock(fd) && bind((system_socket)fd, at->ai_addr, (socklen_t)at->ai_addrlen) == 0 &&
        listen((system_socket)fd, BACKLOG) == 0)
        return fd;
    system_close(fd);
    return -1;
}

int net_socket_listen(const char *host, const char *port, struct net_address *bound, int *error) {
    const struct addrinfo wanted = {.ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE};
    struct addrinfo *found;
    *error = 0;
    system_start();
    if (getaddrinfo(host, port, &wanted, &found) != 0)
        return -1;
    int fd = -1;
    for (const struct addrinfo *at = found; at != NULL && fd < 0; at = at->ai_next)
        fd = listen_at(at);
    *error = system_error();
    freeaddrinfo(found);
    struct sockaddr_storage storage;
    socklen_t size = sizeof storage;
    if (fd >= 0 && getsockname((system_socket)fd, (struct sockaddr *)&storage, &size) == 0)
        from_system(&storage, bound);
    return fd;
}

int net_socket_accept(int listener, struct net_address *from) {
    struct sockaddr_storage storage;
    socklen_t size = sizeof storage;
    int fd = (int)accept((system_socket)listener, (struct sockaddr *)&storage, &size);
    if (fd >= 0)
        from_system(&storage, from);
    return fd;
}

bool net_socket_here(int fd, struct net_address *out) {
    struct sockaddr_storage storage;
    socklen_t size = sizeof storage;
    if (getsockname((system_socket)fd, (struct sockaddr *)&storage, &size) != 0)
        return false;
    from_system(&storage, out);
    return true;
}

bool net_socket_peer(int fd, struct net_address *out) {
    struct sockaddr_storage storage;
    socklen_t size = sizeof storage;
    if (getpeername((system_socket)fd, (struct sockaddr *)&storage, &size) != 0)
        return false;
    from_system(&storage, out);
    return true;
}

bool net_socket_prepare(int fd) {
    if (!system_unblock(fd)) {
        system_close(fd);
        return false;
    }
    set_option(fd, IPPROTO_TCP, TCP_NODELAY, 1); /* an ok waits for no one */
    return true;
}

void net_socket_keep_alive(int fd, int idle_s, int every_s, int count) {
    set_option(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
    set_option(fd, IPPROTO_TCP, SYSTEM_KEEP_IDLE, idle_s);
    set_option(fd, IPPROTO_TCP, TCP_KEEPINTVL, every_s);
    set_option(fd, IPPROTO_TCP, TCP_KEEPCNT, count);
}

/* After a call that failed. */
static long nothing_or_gone(void) {
    return system_would_block() || system_interrupted() ? 0 : NET_GONE;
}

long net_socket_read(int fd, char *bytes, size_t size) {
    long count = (long)recv((system_socket)fd, bytes, (system_size)size, 0);
    /* recv() reports an orderly end by 0; "nothing now" is an error, EWOULDBLOCK. */
    if (count == 0)
        return NET_ENDED;
    return count > 0 ? count : nothing_or_gone();
}

long net_socket_write(int fd, const char *bytes, size_t count) {
    long taken = (long)send((system_socket)fd, bytes, (system_size)count, 0);
    return taken >= 0 ? taken : nothing_or_gone();
}

void net_socket_close(int fd) {
    system_close(fd);
}

/* ---- datagrams ---- */

int net_socket_udp(const struct net_address *here, bool shared, int *error) {
    const struct sockaddr_in at = to_system(here);
    system_start();
    int fd = (int)socket(AF_INET, SOCK_DGRAM, 0);
    /* For multicast DNS: the system's own responder has the port as well. */
    if (fd >= 0 && shared)
        set_option(fd, SOL_SOCKET, SO_REUSEADDR, 1);
    if (fd >= 0 && system_unblock(fd) &&
        bind((system_socket)fd, (const struct sockaddr *)&at, sizeof at) == 0)
        return fd;
    *error = system_error();
    if (fd >= 0)
        system_close(fd);
    return -1;
}

void net_socket_join(int fd, const struct net_address *group, const uint8_t interface[4]) {
    struct ip_mreq request;
    memcpy(&request.imr_multiaddr, group->bytes, 4);
    memcpy(&request.imr_interface, interface, 4);
    (void)setsockopt((system_socket)fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, (const char *)&request,
                     sizeof request);
    (void)setsockopt((system_socket)fd, IPPROTO_IP, IP_MULTICAST_IF, (const char *)&request.imr_interface,
                     sizeof request.imr_interface);
}

void net_socket_send(int fd, const struct net_address *to, const uint8_t *bytes, size_t count) {
    const struct sockaddr_in at = to_system(to);
    long sent = -1;
    /* An ICMP error that waits makes Linux refuse the next datagram, to whom ever it goes, once. */
    for (int tries = 0; tries < 2 && sent < 0 && (tries == 0 || !system_would_block()); tries++)
        sent = (long)sendto((system_socket)fd, (const char *)bytes, (system_size)count, 0,
                            (const struct sockaddr *)&at, sizeof at);
}

void net_socket_watch_unreachable(int fd) {
    system_watch_unreachable(fd);
}

bool net_socket_unreachable(int fd, struct net_address *to) {
    struct sockaddr_storage storage = {0};
    bool unreachable = false;
    for (int i = 0; i < ERRORS_A_CALL && !unreachable; i++)
        if (!system_next_error(fd, &storage, &unreachable))
            break;
    if (unreachable)
        from_system(&storage, to);
    return unreachable;
}

long net_socket_receive(int fd, uint8_t *bytes, size_t size, struct net_address *from) {
    struct sockaddr_storage storage;
    socklen_t from_size = sizeof storage;
    long count = (long)recvfrom((system_socket)fd, (char *)bytes, (system_size)size, 0,
                                (struct sockaddr *)&storage, &from_size);
    if (count < 0)
        return system_would_block() ? NET_NOTHING : NET_GONE;
    from_system(&storage, from);
    return count;
}
