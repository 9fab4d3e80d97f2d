/* SPDX-License-Identifier: MIT */
#include "base/siphash.h"

#include <stdbool.h>
#include <string.h>

enum { LAST_ROUNDS = 3, BLOCK = 8 };

/* Halves of the paper's words v0 .. v3: a chip of 32 bits turns and adds them itself, in half the
 * instructions that a compiler needs for 64. */
struct sip {
    uint32_t low[4], high[4];
};

static inline void add(struct sip *s, unsigned to, unsigned from) {
    s->low[to] += s->low[from];
    s->high[to] += s->high[from] + (s->low[to] < s->low[from]);
}

/* Both halves of (high, low) turned left by `bits`. Xtensa shifts a pair of registers in one instruction, and
 * compilers do not know that. */
#ifdef __XTENSA__
#define TURN(low, high, bits)                                                                                \
    do {                                                                                                     \
        uint32_t low_, high_;                                                                                \
        __asm__("ssai %4\n\tsrc %0, %2, %3\n\tsrc %1, %3, %2"                                                \
                : "=&r"(low_), "=&r"(high_)                                                                  \
                : "r"(low), "r"(high), "i"(32 - (bits)));                                                    \
        (low) = low_, (high) = high_;                                                                        \
    } while (0)
#else
#define TURN(low, high, bits)                                                                                \
    do {                                                                                                     \
        const uint32_t low_ = (low) << (bits) | (high) >> (32 - (bits));                                     \
        (high) = (high) << (bits) | (low) >> (32 - (bits));                                                  \
        (low) = low_;                                                                                        \
    } while (0)
#endif

/* v[which] ^= v[with] */
static inline void mix(struct sip *s, unsigned which, unsigned with) {
    s->low[which] ^= s->low[with];
    s->high[which] ^= s->high[with];
}

static inline void swap(struct sip *s, unsigned which) {
    const uint32_t low = s->low[which];
    s->low[which] = s->high[which];
    s->high[which] = low;
}

static inline void sip_round(struct sip *s) {
    add(s, 0, 1);
    TURN(s->low[1], s->high[1], 13);
    mix(s, 1, 0);
    swap(s, 0);
    add(s, 2, 3);
    TURN(s->low[3], s->high[3], 16);
    mix(s, 3, 2);
    add(s, 0, 3);
    TURN(s->low[3], s->high[3], 21);
    mix(s, 3, 0);
    add(s, 2, 1);
    TURN(s->low[1], s->high[1], 17);
    mix(s, 1, 2);
    swap(s, 2);
}

static inline uint32_t half_of(const uint8_t *bytes) {
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static inline void sip_take(struct sip *s, uint32_t low, uint32_t high) {
    s->low[3] ^= low;
    s->high[3] ^= high;
    sip_round(s);
    s->low[0] ^= low;
    s->high[0] ^= high;
}

/* Of a word that begins at a multiple of four: where bytes have the order of memory, one load and not four.
 */
static inline uint32_t aligned_half_of(const uint8_t *bytes) {
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    uint32_t half;
    memcpy(&half, __builtin_assume_aligned(bytes, sizeof half), sizeof half);
    return half;
#else
    return half_of(bytes);
#endif
}

uint64_t siphash(const uint8_t key[SIPHASH_KEY], const uint8_t *bytes, size_t count) {
    const uint32_t k0 = half_of(key), k1 = half_of(key + 4), k2 = half_of(key + 8), k3 = half_of(key + 12);
    /* The text is the paper's: "somepseudorandomlygeneratedbytes". */
    struct sip s = {{k0 ^ 0x70736575, k2 ^ 0x6E646F6D, k0 ^ 0x6E657261, k2 ^ 0x79746573},
                    {k1 ^ 0x736F6D65, k3 ^ 0x646F7261, k1 ^ 0x6C796765, k3 ^ 0x74656462}};
    uint8_t last[BLOCK] = {[BLOCK - 1] = (uint8_t)count};
    const uint8_t *const end = bytes + count / BLOCK * BLOCK;
    const bool aligned = (uintptr_t)bytes % sizeof(uint32_t) == 0;
    for (; aligned && bytes < end; bytes += BLOCK)
        sip_take(&s, aligned_half_of(bytes), aligned_half_of(bytes + 4));
    for (; bytes < end; bytes += BLOCK)
        sip_take(&s, half_of(bytes), half_of(bytes + 4));
    memcpy(last, bytes, count % BLOCK);
    sip_take(&s, half_of(last), half_of(last + 4));
    s.low[2] ^= 0xFF;
    for (unsigned n = 0; n < LAST_ROUNDS; n++)
        sip_round(&s);
    return (uint64_t)(s.high[0] ^ s.high[1] ^ s.high[2] ^ s.high[3]) << 32 |
           (s.low[0] ^ s.low[1] ^ s.low[2] ^ s.low[3]);
}
