/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "network.h"

#include "wire/packet.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { DATAGRAMS_MAX = 100 }; /* in one call: a flood must not keep us from looking at the pins */

static const char *why(const char *what) {
    static char text[120];
    snprintf(text, sizeof text, "%s: %s", what, strerror(errno));
    return text;
}

static struct sockaddr_in place(struct in_addr address, uint16_t port) {
    return (struct sockaddr_in){.sin_family = AF_INET, .sin_addr = address, .sin_port = htons(port)};
}

static bool bind_to(int fd, struct in_addr address, uint16_t port) {
    struct sockaddr_in at = place(address, port);
    return bind(fd, (struct sockaddr *)&at, sizeof at) == 0;
}

static bool connect_to(int fd, struct in_addr address, uint16_t port) {
    struct sockaddr_in at = place(address, port);
    return connect(fd, (struct sockaddr *)&at, sizeof at) == 0;
}

/* To a controller on this computer from its own address, so that many of them, each with its hosts, fit on
 * one computer; else from whatever the routes say. */
static bool own_address(struct in_addr device, struct in_addr *own) {
    bool is_loopback = (ntohl(device.s_addr) >> 24) == IN_LOOPBACKNET;
    struct sockaddr_in at;
    socklen_t size = sizeof at;
    int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    bool fine = fd >= 0 && connect_to(fd, device, WIRE_UDP_PORT) &&
                getsockname(fd, (struct sockaddr *)&at, &size) == 0;
    if (fd >= 0)
        close(fd);
    if (fine)
        *own = is_loopback ? device : at.sin_addr;
    return fine;
}

/* Reports of all controllers come to one port; a connected socket hears only its own. */
static bool open_status(struct network *network, struct in_addr device, struct in_addr own) {
    int on = 1;
    network->status = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    return network->status >= 0 &&
           setsockopt(network->status, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
           bind_to(network->status, own, WIRE_STATUS_PORT) &&
           connect_to(network->status, device, WIRE_UDP_PORT);
}

static bool open_udp(struct network *network, struct in_addr device, struct in_addr own) {
    network->udp = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    return network->udp >= 0 && bind_to(network->udp, own, 0) &&
           connect_to(network->udp, device, WIRE_UDP_PORT);
}

static bool open_tcp(struct network *network, struct in_addr device, struct in_addr own) {
    int on = 1;
    network->tcp = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    return network->tcp >= 0 && setsockopt(network->tcp, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on) == 0 &&
           bind_to(network->tcp, own, 0) &&
           (connect_to(network->tcp, device, WIRE_CONTROL_PORT) || errno == EINPROGRESS);
}

bool network_is_address(const char *address) {
    struct in_addr device;
    return inet_pton(AF_INET, address, &device) == 1;
}

const char *network_open(struct network *network, const char *address) {
    struct in_addr device, own;
    const char *wrong = NULL;
    *network = (struct network){-1, -1, -1};
    if (inet_pton(AF_INET, address, &device) != 1)
        wrong = "this is not an IPv4 address";
    else if (!own_address(device, &own))
        wrong = why("no way to the controller");
    else if (!open_status(network, device, own))
        wrong = why("cannot listen for status reports");
    else if (!open_udp(network, device, own))
        wrong = why("cannot send datagrams");
    else if (!open_tcp(network, device, own))
        wrong = why("cannot connect");
    if (wrong != NULL)
        network_close(network);
    return wrong;
}

bool network_is_connected(const struct network *network, const char **wrong) {
    struct pollfd one = {.fd = network->tcp, .events = POLLOUT};
    socklen_t size = sizeof errno;
    int error = 0;
    if (poll(&one, 1, 0) <= 0)
        return false;
    if (getsockopt(network->tcp, SOL_SOCKET, SO_ERROR, &error, &size) != 0 || error != 0) {
        errno = error;
        *wrong = why("no controller there");
        return false;
    }
    return true;
}

static bool may_come_later(void) {
    return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

/* A controller that restarts refuses some; whether it lives, its reports tell. */
static void receive_datagrams(int fd, network_taker take, void *ctx) {
    uint8_t packet[WIRE_PACKET_MAX];
    for (unsigned i = 0; i < DATAGRAMS_MAX; i++) {
        ssize_t size = recv(fd, packet, sizeof packet, 0);
        if (size >= 0)
            take(ctx, packet, (size_t)size);
        else if (errno != ECONNREFUSED)
            return;
    }
}

const char *network_receive(const struct network *network, network_taker udp, network_taker tcp, void *ctx) {
    uint8_t bytes[2048];
    receive_datagrams(network->udp, udp, ctx);
    receive_datagrams(network->status, udp, ctx);
    for (;;) {
        ssize_t size = recv(network->tcp, bytes, sizeof bytes, 0);
        if (size == 0)
            return "the controller has closed the connection";
        if (size < 0)
            return may_come_later() ? NULL : why("the connection broke");
        tcp(ctx, bytes, (size_t)size);
    }
}

void network_send_udp(const struct network *network, const uint8_t *bytes, size_t count) {
    (void)!send(network->udp, bytes, count, MSG_NOSIGNAL);
}

bool network_send_tcp(const struct network *network, const uint8_t *bytes, size_t count) {
    return send(network->tcp, bytes, count, MSG_NOSIGNAL) == (ssize_t)count;
}

void network_wait(const struct network *network, double seconds) {
    struct pollfd all[] = {
        {.fd = network->tcp, .events = POLLIN},
        {.fd = network->udp, .events = POLLIN},
        {.fd = network->status, .events = POLLIN},
    };
    struct timespec time = {.tv_sec = (time_t)seconds,
                            .tv_nsec = (long)(1e9 * (seconds - (double)(time_t)seconds))};
    ppoll(all, sizeof all / sizeof *all, &time, NULL);
}

void network_close(struct network *network) {
    int *all[] = {&network->tcp, &network->udp, &network->status};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        if (*all[i] >= 0)
            close(*all[i]);
        *all[i] = -1;
    }
}
