/* SPDX-License-Identifier: MIT */
#include "base/siphash.h"

enum { BLOCK_ROUNDS = 2, LAST_ROUNDS = 4, BLOCK = 8 };

struct sip {
    uint64_t v0, v1, v2, v3;
};

static inline uint64_t turned(uint64_t word, unsigned bits) {
    return word << bits | word >> (64 - bits);
}

static inline void sip_rounds(struct sip *s, unsigned rounds) {
    for (; rounds > 0; rounds--) {
        s->v0 += s->v1;
        s->v2 += s->v3;
        s->v1 = turned(s->v1, 13) ^ s->v0;
        s->v3 = turned(s->v3, 16) ^ s->v2;
        s->v0 = turned(s->v0, 32) + s->v3;
        s->v2 += s->v1;
        s->v1 = turned(s->v1, 17) ^ s->v2;
        s->v3 = turned(s->v3, 21) ^ s->v0;
        s->v2 = turned(s->v2, 32);
    }
}

static inline uint64_t sip_word(const uint8_t *bytes, size_t count) {
    uint64_t word = 0;
    for (size_t i = 0; i < count; i++)
        word |= (uint64_t)bytes[i] << (8 * i);
    return word;
}

static inline void sip_take(struct sip *s, uint64_t word) {
    s->v3 ^= word;
    sip_rounds(s, BLOCK_ROUNDS);
    s->v0 ^= word;
}

uint64_t siphash(const uint8_t key[SIPHASH_KEY], const uint8_t *bytes, size_t count) {
    const uint64_t k0 = sip_word(key, BLOCK), k1 = sip_word(key + BLOCK, BLOCK);
    /* The text is the paper's: "somepseudorandomlygeneratedbytes". */
    struct sip s = {k0 ^ 0x736F6D6570736575, k1 ^ 0x646F72616E646F6D, k0 ^ 0x6C7967656E657261,
                    k1 ^ 0x7465646279746573};
    size_t at = 0;
    for (; count - at >= BLOCK; at += BLOCK)
        sip_take(&s, sip_word(bytes + at, BLOCK));
    sip_take(&s, sip_word(bytes + at, count - at) | (uint64_t)(count & 0xFF) << 56);
    s.v2 ^= 0xFF;
    sip_rounds(&s, LAST_ROUNDS);
    return s.v0 ^ s.v1 ^ s.v2 ^ s.v3;
}
