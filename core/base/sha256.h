/* SPDX-License-Identifier: MIT
 * SHA-256 and HMAC-SHA-256 (FIPS 180-4, RFC 2104). No state outside the struct. [any context] */
#ifndef WIFICNC_BASE_SHA256_H
#define WIFICNC_BASE_SHA256_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { SHA256_SIZE = 32, SHA256_BLOCK = 64 };

struct sha256 {
    uint32_t state[8];
    uint64_t count; /* bytes so far */
    uint8_t block[SHA256_BLOCK];
};

void sha256_begin(struct sha256 *sha);
void sha256_add(struct sha256 *sha, const uint8_t *bytes, size_t count);
void sha256_end(struct sha256 *sha, uint8_t digest[SHA256_SIZE]);

void hmac_sha256(const uint8_t *key, size_t key_size, const uint8_t *bytes, size_t count,
                 uint8_t mac[SHA256_SIZE]);

/** Takes the same time wherever the first difference is. */
bool sha256_is_equal(const uint8_t a[SHA256_SIZE], const uint8_t b[SHA256_SIZE]);

#endif
