/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's arpa/inet.h (lwIP), declared again: enough to compile against, checked against
 * the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "netinet/in.h"

const char *inet_ntop(int family, const void *from, char *text, socklen_t size);
int inet_pton(int family, const char *text, void *to);
uint16_t htons(uint16_t number);
uint16_t ntohs(uint16_t number);
