/* SPDX-License-Identifier: MIT */
#include "net_mdns_udp.h"

#include "net_socket.h"

/* A flood of questions must not hold up the caller's loop. */
enum { PACKETS_A_POLL = 4 };

static const struct net_address group = {.bytes = {224, 0, 0, 251}, .port = NET_MDNS_PORT};

int net_mdns_open(const char *host, uint16_t port) {
    struct net_address here;
    int error;
    return net_address_v4(host, port, &here) ? net_socket_udp(&here, true, &error) : -1;
}

static void announce(int fd, const struct net_mdns *mdns, bool leaves) {
    uint8_t packet[NET_MDNS_PACKET];
    size_t size = net_mdns_announce(mdns, leaves, packet);
    if (size > 0)
        net_socket_send(fd, &group, packet, size);
}

void net_mdns_join(int fd, const struct net_mdns *mdns) {
    /* Membership belongs to an address: it is joined again, and announced, whenever that changes. */
    net_socket_join(fd, &group, mdns->address);
    announce(fd, mdns, false);
}

void net_mdns_leave(int fd, const struct net_mdns *mdns) {
    announce(fd, mdns, true);
}

void net_mdns_poll(int fd, struct net_mdns *mdns, uint32_t now_us) {
    uint8_t query[NET_MDNS_QUERY], answer[NET_MDNS_PACKET];
    for (int i = 0; i < PACKETS_A_POLL; i++) {
        struct net_address from;
        bool unicast;
        long count = net_socket_receive(fd, query, sizeof query, &from);
        if (count <= 0)
            return;
        bool legacy = from.port != NET_MDNS_PORT;
        size_t size = net_mdns_answer(mdns, query, (size_t)count, legacy, answer, &unicast);
        if (size > 0 && net_mdns_may_answer(mdns, now_us))
            net_socket_send(fd, unicast ? &from : &group, answer, size);
    }
}
