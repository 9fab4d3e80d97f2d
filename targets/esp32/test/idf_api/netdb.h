/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's netdb.h (lwIP), declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "sys/socket.h"

struct addrinfo {
    int ai_flags, ai_family, ai_socktype, ai_protocol;
    socklen_t ai_addrlen;
    struct sockaddr *ai_addr;
    char *ai_canonname;
    struct addrinfo *ai_next;
};

#define AI_PASSIVE 0x01

int getaddrinfo(const char *host, const char *port, const struct addrinfo *wanted, struct addrinfo **found);
void freeaddrinfo(struct addrinfo *found);
