/* SPDX-License-Identifier: MIT */
#include "base/sha256.h"

#include <string.h>

enum { ROUNDS = 64, WORDS = 16, LENGTH_AT = SHA256_BLOCK - 8 };

/* First 32 bits of the fractions of the cube roots of the first 64 primes (FIPS 180-4, 4.2.2). */
static const uint32_t round_constant[ROUNDS] = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

static uint32_t rotate(uint32_t word, unsigned by) {
    return word >> by | word << (32 - by);
}

static void expand(const uint8_t block[SHA256_BLOCK], uint32_t word[ROUNDS]) {
    for (unsigned i = 0; i < WORDS; i++, block += 4)
        word[i] = (uint32_t)block[0] << 24 | (uint32_t)block[1] << 16 | (uint32_t)block[2] << 8 | block[3];
    for (unsigned i = WORDS; i < ROUNDS; i++) {
        uint32_t far = word[i - 15], near = word[i - 2];
        uint32_t small0 = rotate(far, 7) ^ rotate(far, 18) ^ far >> 3;
        uint32_t small1 = rotate(near, 17) ^ rotate(near, 19) ^ near >> 10;
        word[i] = word[i - 16] + small0 + word[i - 7] + small1;
    }
}

/* s[0] .. s[7] are a .. h of the standard. */
static void compress(struct sha256 *sha, const uint8_t block[SHA256_BLOCK]) {
    uint32_t word[ROUNDS], s[8];
    expand(block, word);
    memcpy(s, sha->state, sizeof s);
    for (unsigned i = 0; i < ROUNDS; i++) {
        uint32_t big1 = rotate(s[4], 6) ^ rotate(s[4], 11) ^ rotate(s[4], 25);
        uint32_t choose = (s[4] & s[5]) ^ (~s[4] & s[6]);
        uint32_t first = s[7] + big1 + choose + round_constant[i] + word[i];
        uint32_t big0 = rotate(s[0], 2) ^ rotate(s[0], 13) ^ rotate(s[0], 22);
        uint32_t majority = (s[0] & s[1]) ^ (s[0] & s[2]) ^ (s[1] & s[2]);
        memmove(s + 1, s, 7 * sizeof s[0]);
        s[4] += first;
        s[0] = first + big0 + majority;
    }
    for (unsigned i = 0; i < 8; i++)
        sha->state[i] += s[i];
}

void sha256_begin(struct sha256 *sha) {
    /* fractions of the square roots of the first 8 primes (5.3.3) */
    *sha = (struct sha256){.state = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a, 0x510e527f, 0x9b05688c,
                                     0x1f83d9ab, 0x5be0cd19}};
}

void sha256_add(struct sha256 *sha, const void *bytes, size_t count) {
    const uint8_t *from = bytes;
    while (count > 0) {
        size_t at = sha->bytes % SHA256_BLOCK, room = SHA256_BLOCK - at;
        size_t piece = count < room ? count : room;
        memcpy(sha->block + at, from, piece);
        sha->bytes += piece;
        from += piece;
        count -= piece;
        if (piece == room)
            compress(sha, sha->block);
    }
}

void sha256_end(struct sha256 *sha, uint8_t digest[SHA256_SIZE]) {
    static const uint8_t one = 0x80, zero = 0;
    const uint64_t bits = sha->bytes * 8;
    uint8_t length[8];
    for (unsigned i = 0; i < 8; i++)
        length[i] = (uint8_t)(bits >> (56 - 8 * i));
    sha256_add(sha, &one, 1);
    while (sha->bytes % SHA256_BLOCK != LENGTH_AT)
        sha256_add(sha, &zero, 1);
    sha256_add(sha, length, sizeof length);
    for (unsigned i = 0; i < SHA256_SIZE; i++)
        digest[i] = (uint8_t)(sha->state[i / 4] >> (24 - 8 * (i % 4)));
}

/* RFC 2104: the two hashes behind their padded keys. */
static void begin_hmac(const void *key, size_t key_size, struct sha256 *inner, struct sha256 *outer) {
    uint8_t pad[SHA256_BLOCK] = {0};
    if (key_size > SHA256_BLOCK) {
        sha256_begin(inner);
        sha256_add(inner, key, key_size);
        sha256_end(inner, pad);
    } else {
        memcpy(pad, key, key_size);
    }
    for (unsigned i = 0; i < SHA256_BLOCK; i++)
        pad[i] ^= 0x36;
    sha256_begin(inner);
    sha256_add(inner, pad, sizeof pad);
    for (unsigned i = 0; i < SHA256_BLOCK; i++)
        pad[i] ^= 0x36 ^ 0x5C;
    sha256_begin(outer);
    sha256_add(outer, pad, sizeof pad);
}

/* Both are copies: they serve more than one message. */
static void end_hmac(struct sha256 inner, struct sha256 outer, uint8_t mac[SHA256_SIZE]) {
    sha256_end(&inner, mac);
    sha256_add(&outer, mac, SHA256_SIZE);
    sha256_end(&outer, mac);
}

void sha256_hmac(const void *key, size_t key_size, const void *message, size_t size,
                 uint8_t mac[SHA256_SIZE]) {
    struct sha256 inner, outer;
    begin_hmac(key, key_size, &inner, &outer);
    sha256_add(&inner, message, size);
    end_hmac(inner, outer, mac);
}

void sha256_pbkdf2(const void *password, size_t password_size, const void *salt, size_t salt_size,
                   uint32_t rounds, uint8_t secret[SHA256_SIZE]) {
    static const uint8_t first_block[4] = {0, 0, 0, 1};
    struct sha256 inner, outer;
    uint8_t u[SHA256_SIZE];
    begin_hmac(password, password_size, &inner, &outer);
    struct sha256 salted = inner;
    sha256_add(&salted, salt, salt_size);
    sha256_add(&salted, first_block, sizeof first_block);
    end_hmac(salted, outer, u);
    memcpy(secret, u, SHA256_SIZE);
    for (uint32_t round = 1; round < rounds; round++) {
        struct sha256 next = inner;
        sha256_add(&next, u, sizeof u);
        end_hmac(next, outer, u);
        for (unsigned i = 0; i < SHA256_SIZE; i++)
            secret[i] ^= u[i];
    }
}

bool sha256_is_equal(const uint8_t first[SHA256_SIZE], const uint8_t second[SHA256_SIZE]) {
    uint8_t differs = 0;
    for (unsigned i = 0; i < SHA256_SIZE; i++)
        differs |= first[i] ^ second[i];
    return differs == 0;
}
