/* SPDX-License-Identifier: MIT
 * Names and tables are those of ISO/IEC 18004:2015; its clause is at each step. */
#include "net_qr.h"

#include <string.h>

enum { VERSIONS = 5, CODEWORDS = 134, EC_MAX = 26 };

/* Table 9, error correction level L. */
static const struct version {
    uint8_t data, ec; /* codewords */
} versions[VERSIONS] = {{19, 7}, {34, 10}, {55, 15}, {80, 20}, {108, 26}};

/* Table C.1: level L, mask 000. */
#define FORMAT 0x77C4u

/* The mode's nibble, the length, and the terminator's nibble. */
enum { MODE_BYTES = 4, FRAME_BYTES = 2 };

/* ---- codewords ---- */

/* GF(256) by the polynomial 0x11D (7.5.2). */
static uint8_t gf_multiply(uint8_t a, uint8_t b) {
    unsigned product = 0;
    for (int bit = 7; bit >= 0; bit--)
        product = product << 1 ^ (product >> 7) * 0x11Du ^ (b >> bit & 1u) * a;
    return (uint8_t)product;
}

/* The generator is the product of x - 2^i for i < count; `ec` gets the rest of the data's division by it. */
static void correct(const uint8_t *data, size_t size, uint8_t *ec, size_t count) {
    uint8_t generator[EC_MAX] = {0}, root = 1;
    generator[count - 1] = 1;
    for (size_t i = 0; i < count; i++, root = gf_multiply(root, 2))
        for (size_t j = 0; j < count; j++)
            generator[j] =
                (uint8_t)(gf_multiply(generator[j], root) ^ (j + 1 < count ? generator[j + 1] : 0));
    memset(ec, 0, count);
    for (size_t i = 0; i < size; i++) {
        const uint8_t factor = data[i] ^ ec[0];
        memmove(ec, ec + 1, count - 1);
        ec[count - 1] = 0;
        for (size_t j = 0; j < count; j++)
            ec[j] ^= gf_multiply(generator[j], factor);
    }
}

/* 7.4: everything after the mode's nibble is shifted by it. */
static void fill(const struct version *version, const char *text, uint8_t codewords[CODEWORDS]) {
    const size_t size = strlen(text);
    uint8_t before = MODE_BYTES << 4, *next = codewords;
    for (size_t i = 0; i <= size; i++) {
        const uint8_t byte = i == 0 ? (uint8_t)size : (uint8_t)text[i - 1];
        *next++ = before | byte >> 4;
        before = (uint8_t)(byte << 4);
    }
    *next++ = before;
    for (uint8_t pad = 0xEC; next < codewords + version->data; pad ^= 0xEC ^ 0x11)
        *next++ = pad;
    correct(codewords, version->data, next, version->ec);
}

/* ---- modules ---- */

static void put(struct net_qr *qr, unsigned x, unsigned y, bool dark) {
    const uint64_t bit = (uint64_t)1 << x;
    qr->row[y] = dark ? qr->row[y] | bit : qr->row[y] & ~bit;
}

static unsigned distance(unsigned a, unsigned b) {
    return a > b ? a - b : b - a;
}

/* Of the larger of both axes. */
static unsigned ring(unsigned x, unsigned y, unsigned centre_x, unsigned centre_y) {
    const unsigned dx = distance(x, centre_x), dy = distance(y, centre_y);
    return dx > dy ? dx : dy;
}

enum { FINDER_CENTRE = 3, ALIGNMENT_FROM_END = 7, TIMING = 6, FORMAT_AT = 8 };

static bool in_alignment(unsigned side, unsigned x, unsigned y) {
    return side > 21 && ring(x, y, side - ALIGNMENT_FROM_END, side - ALIGNMENT_FROM_END) <= 2;
}

/* Patterns and format information; no codeword lies there. */
static bool is_function(unsigned side, unsigned x, unsigned y) {
    const bool left = x <= FORMAT_AT, top = y <= FORMAT_AT;
    return (left && top) || (left && y >= side - FORMAT_AT) || (top && x >= side - FORMAT_AT) ||
           x == TIMING || y == TIMING || in_alignment(side, x, y);
}

/* 6.3 */
static bool pattern(unsigned side, unsigned x, unsigned y) {
    const unsigned end = side - 1 - FINDER_CENTRE;
    const unsigned centres[3][2] = {
        {FINDER_CENTRE, FINDER_CENTRE}, {end, FINDER_CENTRE}, {FINDER_CENTRE, end}};
    for (unsigned i = 0; i < 3; i++) {
        const unsigned at = ring(x, y, centres[i][0], centres[i][1]);
        if (at <= 4)
            return at != 2 && at != 4;
    }
    if (in_alignment(side, x, y))
        return ring(x, y, side - ALIGNMENT_FROM_END, side - ALIGNMENT_FROM_END) != 1;
    return (x + y) % 2 == 0;
}

/* 7.9.1, twice; the module that is always dark is above the second copy. */
static void put_format(struct net_qr *qr) {
    const unsigned end = qr->side - 1;
    for (unsigned i = 0; i < 15; i++) {
        const bool dark = FORMAT >> i & 1u;
        const unsigned first = i < 6 ? i : i < 8 ? i + 1 : i == 8 ? 7 : 14 - i;
        put(qr, i < 8 ? FORMAT_AT : first, i < 8 ? first : FORMAT_AT, dark);
        put(qr, i < 8 ? end - i : FORMAT_AT, i < 8 ? FORMAT_AT : end - 14 + i, dark);
    }
    put(qr, FORMAT_AT, end - 7, true);
}

/* 7.7.3: columns of two from the right, up and down in turn; mask 0 turns every module at an even x + y. */
static void put_codewords(struct net_qr *qr, const uint8_t *codewords, size_t count) {
    size_t at = 0;
    bool up = true;
    for (unsigned right = qr->side - 1; right < qr->side; right -= 2, up = !up) {
        right -= right == TIMING;
        for (unsigned i = 0; i < 2 * qr->side; i++) {
            const unsigned x = right - i % 2, y = up ? qr->side - 1 - i / 2 : i / 2;
            if (is_function(qr->side, x, y))
                continue;
            const bool bit = at < 8 * count && (codewords[at / 8] >> (7 - at % 8) & 1);
            put(qr, x, y, bit != ((x + y) % 2 == 0));
            at++;
        }
    }
}

bool net_qr_make(struct net_qr *qr, const char *text) {
    uint8_t codewords[CODEWORDS] = {0};
    unsigned number = 0;
    while (number < VERSIONS && strlen(text) + FRAME_BYTES > versions[number].data)
        number++;
    if (number == VERSIONS)
        return false;
    const struct version *version = &versions[number];
    *qr = (struct net_qr){.side = 21 + 4 * number};
    fill(version, text, codewords);
    for (unsigned y = 0; y < qr->side; y++)
        for (unsigned x = 0; x < qr->side; x++)
            put(qr, x, y, pattern(qr->side, x, y));
    put_format(qr);
    put_codewords(qr, codewords, version->data + version->ec);
    return true;
}

/* ---- text ---- */

/* The border is light; unsigned coordinates before 0 are beyond the end. */
static bool is_light(const struct net_qr *qr, unsigned x, unsigned y) {
    return x >= qr->side || y >= qr->side || (qr->row[y] >> x & 1) == 0;
}

bool net_qr_row(const struct net_qr *qr, unsigned number, char *out) {
    static const char *const blocks[] = {" ", "\xE2\x96\x84", "\xE2\x96\x80", "\xE2\x96\x88"};
    const unsigned y = 2 * number - NET_QR_QUIET;
    if (2 * number >= qr->side + 2 * NET_QR_QUIET)
        return false;
    *out = '\0';
    for (unsigned i = 0; i < qr->side + 2 * NET_QR_QUIET; i++) {
        const unsigned x = i - NET_QR_QUIET;
        const char *block = blocks[2 * is_light(qr, x, y) + is_light(qr, x, y + 1)];
        const size_t size = strlen(block);
        memcpy(out, block, size + 1);
        out += size;
    }
    return true;
}
