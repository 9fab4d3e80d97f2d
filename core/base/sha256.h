/* SPDX-License-Identifier: MIT
 * SHA-256 (FIPS 180-4), HMAC-SHA256 (RFC 2104) and PBKDF2 with it (RFC 8018). [task] Pure. */
#ifndef WIFICNC_BASE_SHA256_H
#define WIFICNC_BASE_SHA256_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { SHA256_SIZE = 32, SHA256_BLOCK = 64 };

struct sha256 {
    uint32_t state[8];
    uint64_t bytes;
    uint8_t block[SHA256_BLOCK]; /* the last bytes % SHA256_BLOCK of them wait here */
};

void sha256_begin(struct sha256 *sha);
void sha256_add(struct sha256 *sha, const void *bytes, size_t count);
void sha256_end(struct sha256 *sha, uint8_t digest[SHA256_SIZE]);

/** Message authentication code of one message. */
void sha256_hmac(const void *key, size_t key_size, const void *message, size_t size,
                 uint8_t mac[SHA256_SIZE]);

/** A secret from a password: each guess costs whoever tries them `rounds` times as much as a digest.
 *  @param rounds  1 or more; one takes about 4 times the time of sha256_add() of a block */
void sha256_pbkdf2(const void *password, size_t password_size, const void *salt, size_t salt_size,
                   uint32_t rounds, uint8_t secret[SHA256_SIZE]);

/** Whether two digests are equal, in a time that does not tell where they differ. */
bool sha256_is_equal(const uint8_t first[SHA256_SIZE], const uint8_t second[SHA256_SIZE]);

#endif
