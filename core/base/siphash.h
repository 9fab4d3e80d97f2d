/* SPDX-License-Identifier: MIT
 * SipHash-1-3 (Aumasson, Bernstein 2012), a keyed digest of short messages: a message authentication code for
 * each datagram. [task] Pure. An ESP32 takes some 8 instructions a byte (docs/performance.md); HMAC-SHA256
 * more. docs/security.md says why one round for each block is enough here; proofs with keys that live for
 * longer than a session are HMAC-SHA256.
 */
#ifndef WIFICNC_BASE_SIPHASH_H
#define WIFICNC_BASE_SIPHASH_H

#include <stddef.h>
#include <stdint.h>

enum { SIPHASH_KEY = 16 };

/** @param bytes  at any address */
uint64_t siphash(const uint8_t key[SIPHASH_KEY], const uint8_t *bytes, size_t count);

#endif
