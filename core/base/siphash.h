/* SPDX-License-Identifier: MIT
 * SipHash-2-4 (Aumasson, Bernstein 2012), a keyed digest of short messages: a message authentication code for
 * each datagram. [task] Pure. An ESP32 takes some 15 instructions a byte (docs/performance.md); HMAC-SHA256
 * more.
 */
#ifndef WIFICNC_BASE_SIPHASH_H
#define WIFICNC_BASE_SIPHASH_H

#include <stddef.h>
#include <stdint.h>

enum { SIPHASH_KEY = 16 };

/** @param bytes  at any address */
uint64_t siphash(const uint8_t key[SIPHASH_KEY], const uint8_t *bytes, size_t count);

#endif
