/* SPDX-License-Identifier: MIT
 * What the seal of a datagram costs on the chip: its instructions, in units of 64, as the exit code. The
 * clock of the emulator advances evenly with each instruction; how far is measured first. */
#include "wire/seal.h"

#include <stdint.h>

enum { SIZE_MAX_HERE = 512, NOPS = 1024, UNIT = 64, WRONG = 255 };

extern const unsigned datagram_size; /* written by the test */

/* tests/xtensa/vector/start.S has a vector for it; no interrupt is enabled here. */
void xt_highint5(void);
void xt_highint5(void) {}

/* The compiler calls them. */
void *memset(void *to, int value, __SIZE_TYPE__ count) {
    for (volatile char *at = to; count > 0; count--)
        *at++ = (char)value;
    return to;
}

void *memcpy(void *restrict to, const void *restrict from, __SIZE_TYPE__ count) {
    volatile char *at = to;
    for (const char *next = from; count > 0; count--)
        *at++ = *next++;
    return to;
}

static uint32_t ticks(void) {
    uint32_t now;
    __asm__ volatile("rsr %0, ccount" : "=r"(now) : : "memory");
    return now;
}

/* The message of the paper's appendix A, wherever the bytes lie. */
static bool is_siphash(void) {
    static _Alignas(4) uint8_t text[16 + 4];
    uint8_t key[SIPHASH_KEY];
    bool right = true;
    for (unsigned at = 0; at < 4; at++) {
        for (unsigned i = 0; i < SIPHASH_KEY; i++)
            key[i] = text[at + i] = (uint8_t)i;
        right &= siphash(key, text + at, 15) == 0xD320D86D2A519956u;
    }
    return right;
}

int main(void) {
    static _Alignas(4) uint8_t packet[SIZE_MAX_HERE]; /* as that of targets/net/net_wire.c */
    struct seal host = {.session = 7, .key = {1, 2, 3, 4, 5}}, device = host;
    for (unsigned i = 0; i < datagram_size; i++)
        packet[i] = (uint8_t)(i * 37);
    const uint32_t first = ticks();
    __asm__ volatile(".rept 1024\n nop\n .endr" : : : "memory");
    const uint32_t a_nop = ticks() - first;
    const size_t size = seal_close(&host, packet, datagram_size);
    const uint32_t begin = ticks();
    const bool good = seal_open(&device, packet, datagram_size, size);
    const uint32_t took = ticks() - begin;
    const uint32_t instructions = took * NOPS / a_nop;
    const uint32_t units = (instructions + UNIT - 1) / UNIT;
    if (!is_siphash() || !good || seal_open(&device, packet, datagram_size, size) || units >= WRONG)
        return WRONG;
    return (int)units;
}
