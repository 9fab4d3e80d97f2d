/* SPDX-License-Identifier: MIT */
#include "base/siphash.h"

#include <string.h>

enum { LAST_ROUNDS = 4, BLOCK = 8 };

/* Halves of the paper's words v0 .. v3: a chip of 32 bits turns and adds them itself, in half the
 * instructions that a compiler needs for 64. */
struct sip {
    uint32_t low[4], high[4];
};

static inline void add(struct sip *s, unsigned to, unsigned from) {
    s->low[to] += s->low[from];
    s->high[to] += s->high[from] + (s->low[to] < s->low[from]);
}

/* v[to] = (v[to] turned left by `bits`) ^ v[with] */
static inline void turn(struct sip *s, unsigned to, unsigned bits, unsigned with) {
    const uint32_t low = s->low[to] << bits | s->high[to] >> (32 - bits);
    const uint32_t high = s->high[to] << bits | s->low[to] >> (32 - bits);
    s->low[to] = low ^ s->low[with];
    s->high[to] = high ^ s->high[with];
}

static inline void swap(struct sip *s, unsigned which) {
    const uint32_t low = s->low[which];
    s->low[which] = s->high[which];
    s->high[which] = low;
}

static inline void sip_round(struct sip *s) {
    add(s, 0, 1);
    turn(s, 1, 13, 0);
    swap(s, 0);
    add(s, 2, 3);
    turn(s, 3, 16, 2);
    add(s, 0, 3);
    turn(s, 3, 21, 0);
    add(s, 2, 1);
    turn(s, 1, 17, 2);
    swap(s, 2);
}

static inline uint32_t half_of(const uint8_t *bytes) {
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static inline void sip_take(struct sip *s, uint32_t low, uint32_t high) {
    s->low[3] ^= low;
    s->high[3] ^= high;
    sip_round(s);
    sip_round(s);
    s->low[0] ^= low;
    s->high[0] ^= high;
}

uint64_t siphash(const uint8_t key[SIPHASH_KEY], const uint8_t *bytes, size_t count) {
    const uint32_t k0 = half_of(key), k1 = half_of(key + 4), k2 = half_of(key + 8), k3 = half_of(key + 12);
    /* The text is the paper's: "somepseudorandomlygeneratedbytes". */
    struct sip s = {{k0 ^ 0x70736575, k2 ^ 0x6E646F6D, k0 ^ 0x6E657261, k2 ^ 0x79746573},
                    {k1 ^ 0x736F6D65, k3 ^ 0x646F7261, k1 ^ 0x6C796765, k3 ^ 0x74656462}};
    uint8_t last[BLOCK] = {[BLOCK - 1] = (uint8_t)count};
    for (const uint8_t *end = bytes + count / BLOCK * BLOCK; bytes < end; bytes += BLOCK)
        sip_take(&s, half_of(bytes), half_of(bytes + 4));
    memcpy(last, bytes, count % BLOCK);
    sip_take(&s, half_of(last), half_of(last + 4));
    s.low[2] ^= 0xFF;
    for (unsigned n = 0; n < LAST_ROUNDS; n++)
        sip_round(&s);
    return (uint64_t)(s.high[0] ^ s.high[1] ^ s.high[2] ^ s.high[3]) << 32 |
           (s.low[0] ^ s.low[1] ^ s.low[2] ^ s.low[3]);
}
