/* SPDX-License-Identifier: MIT
 * SHA-1 (FIPS 180-4) of a short text. [task] Pure. For the WebSocket handshake alone, which asks for it (RFC
 * 6455, 4.2.2): it is broken, and proves nothing. */
#ifndef WIFICNC_NET_SHA1_H
#define WIFICNC_NET_SHA1_H

#include <stddef.h>
#include <stdint.h>

enum { NET_SHA1_SIZE = 20, NET_SHA1_TEXT_MAX = 119 };

/** @param size  0 .. NET_SHA1_TEXT_MAX */
void net_sha1(const void *text, size_t size, uint8_t digest[NET_SHA1_SIZE]);

#endif
