/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's netinet/in.h (lwIP), declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "sys/socket.h"

#define IPPROTO_IP        0
#define IPPROTO_TCP       6
#define IP_ADD_MEMBERSHIP 3
#define IP_MULTICAST_IF   6
#define INET6_ADDRSTRLEN  46

typedef uint16_t in_port_t;

struct in_addr {
    uint32_t s_addr;
};

struct ip_mreq {
    struct in_addr imr_multiaddr, imr_interface;
};

struct in6_addr {
    uint32_t words[4];
};

struct sockaddr_in {
    uint8_t sin_len;
    sa_family_t sin_family;
    in_port_t sin_port;
    struct in_addr sin_addr;
    char sin_zero[8];
};

struct sockaddr_in6 {
    uint8_t sin6_len;
    sa_family_t sin6_family;
    in_port_t sin6_port;
    uint32_t sin6_flowinfo;
    struct in6_addr sin6_addr;
    uint32_t sin6_scope_id;
};
