/* SPDX-License-Identifier: MIT */
#include "net_sha1.h"

#include <string.h>

enum { BLOCK = 64, ROUNDS = 80, WORDS = 16, LENGTH_SIZE = 8 };

static uint32_t rotate(uint32_t word, unsigned by) {
    return word << by | word >> (32 - by);
}

static uint32_t read_word(const uint8_t *bytes) {
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

static void write_word(uint8_t *bytes, uint32_t word) {
    for (unsigned i = 0; i < 4; i++)
        bytes[i] = (uint8_t)(word >> (24 - 8 * i));
}

/* f and K of round t (FIPS 180-4, 4.1.1 and 4.2.1). */
static uint32_t mix(unsigned t, uint32_t b, uint32_t c, uint32_t d) {
    if (t < 20)
        return ((b & c) ^ (~b & d)) + 0x5a827999;
    if (t < 40)
        return (b ^ c ^ d) + 0x6ed9eba1;
    if (t < 60)
        return ((b & c) ^ (b & d) ^ (c & d)) + 0x8f1bbcdc;
    return (b ^ c ^ d) + 0xca62c1d6;
}

/* s[0] .. s[4] are a .. e of the standard. */
static void compress(uint32_t state[5], const uint8_t block[BLOCK]) {
    uint32_t word[ROUNDS], s[5];
    for (unsigned t = 0; t < WORDS; t++)
        word[t] = read_word(block + (size_t)4 * t);
    for (unsigned t = WORDS; t < ROUNDS; t++)
        word[t] = rotate(word[t - 3] ^ word[t - 8] ^ word[t - 14] ^ word[t - 16], 1);
    memcpy(s, state, sizeof s);
    for (unsigned t = 0; t < ROUNDS; t++) {
        uint32_t next = rotate(s[0], 5) + mix(t, s[1], s[2], s[3]) + s[4] + word[t];
        s[4] = s[3];
        s[3] = s[2];
        s[2] = rotate(s[1], 30);
        s[1] = s[0];
        s[0] = next;
    }
    for (unsigned i = 0; i < 5; i++)
        state[i] += s[i];
}

void net_sha1(const void *text, size_t size, uint8_t digest[NET_SHA1_SIZE]) {
    uint32_t state[5] = {0x67452301, 0xefcdab89, 0x98badcfe, 0x10325476, 0xc3d2e1f0};
    uint8_t padded[2 * BLOCK] = {0};
    size_t blocks = (size + 1 + LENGTH_SIZE + BLOCK - 1) / BLOCK;
    memcpy(padded, text, size);
    padded[size] = 0x80;
    /* The length has 64 bits; the upper 32 are 0 for a text this short. */
    write_word(padded + blocks * BLOCK - 4, (uint32_t)size * 8);
    for (size_t i = 0; i < blocks; i++)
        compress(state, padded + i * BLOCK);
    for (unsigned i = 0; i < 5; i++)
        write_word(digest + (size_t)4 * i, state[i]);
}
