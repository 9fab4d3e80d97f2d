/* SPDX-License-Identifier: MIT */
#ifndef ESP_PLATFORM
#define _DEFAULT_SOURCE /* ip_mreq */
#endif
#include "net_mdns_udp.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { PACKETS_A_POLL = 4 };

static const char group[] = "224.0.0.251";

int net_mdns_open(const char *host, uint16_t port) {
    struct sockaddr_in here = {.sin_family = AF_INET, .sin_port = htons(port)};
    const int on = 1;
    int fd = socket(AF_INET, SOCK_DGRAM, 0);
    if (fd < 0)
        return -1;
    (void)setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (inet_pton(AF_INET, host, &here.sin_addr) == 1 &&
        bind(fd, (const struct sockaddr *)&here, sizeof here) == 0 && fcntl(fd, F_SETFL, O_NONBLOCK) == 0)
        return fd;
    close(fd);
    return -1;
}

static void send_to_all(int fd, const uint8_t *packet, size_t size) {
    struct sockaddr_in all = {.sin_family = AF_INET, .sin_port = htons(NET_MDNS_PORT)};
    (void)inet_pton(AF_INET, group, &all.sin_addr);
    (void)sendto(fd, packet, size, 0, (const struct sockaddr *)&all, sizeof all);
}

void net_mdns_join(int fd, const struct net_mdns *mdns) {
    uint8_t packet[NET_MDNS_PACKET];
    struct ip_mreq request;
    (void)inet_pton(AF_INET, group, &request.imr_multiaddr);
    memcpy(&request.imr_interface, mdns->address, sizeof mdns->address);
    (void)setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &request, sizeof request);
    (void)setsockopt(fd, IPPROTO_IP, IP_MULTICAST_IF, &request.imr_interface, sizeof request.imr_interface);
    size_t size = net_mdns_announce(mdns, packet);
    if (size > 0)
        send_to_all(fd, packet, size);
}

void net_mdns_poll(int fd, const struct net_mdns *mdns) {
    uint8_t query[NET_MDNS_PACKET], answer[NET_MDNS_PACKET];
    for (int i = 0; i < PACKETS_A_POLL; i++) {
        struct sockaddr_in from;
        socklen_t from_size = sizeof from;
        bool unicast;
        long count = recvfrom(fd, query, sizeof query, 0, (struct sockaddr *)&from, &from_size);
        if (count <= 0)
            return;
        bool legacy = from.sin_port != htons(NET_MDNS_PORT);
        size_t size = net_mdns_answer(mdns, query, (size_t)count, legacy, answer, &unicast);
        if (size == 0)
            continue;
        if (unicast)
            (void)sendto(fd, answer, size, 0, (const struct sockaddr *)&from, from_size);
        else
            send_to_all(fd, answer, size);
    }
}
