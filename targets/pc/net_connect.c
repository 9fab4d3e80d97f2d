/* SPDX-License-Identifier: MIT */
#include "net_connect.h"

#include "net_system.h"

static int connect_to(const struct addrinfo *at) {
    int fd = (int)socket(at->ai_family, at->ai_socktype, at->ai_protocol);
    if (fd < 0 || connect((system_socket)fd, at->ai_addr, (socklen_t)at->ai_addrlen) == 0)
        return fd;
    system_close(fd);
    return -1;
}

int net_connect(const char *host, const char *port) {
    const struct addrinfo wanted = {.ai_socktype = SOCK_STREAM};
    struct addrinfo *found;
    system_start();
    if (getaddrinfo(host, port, &wanted, &found) != 0)
        return -1;
    int fd = -1;
    for (const struct addrinfo *at = found; at != NULL && fd < 0; at = at->ai_next)
        fd = connect_to(at);
    freeaddrinfo(found);
    return fd;
}
