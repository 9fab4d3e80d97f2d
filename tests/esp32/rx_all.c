/* SPDX-License-Identifier: MIT
 * Bytes in one go and byte by byte leave the same receive buffer behind, whatever they are and however full
 * it is; and so do runs of a line's plain bytes. */
#include "check.h"
#include "input/rx.h"
#include "net_line.h"

#include <string.h>

enum { ROUNDS = 20000, MOST = RX_SIZE / 3 };

static unsigned random_below(unsigned end) {
    static uint64_t state = 88172645463325252u;
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return (unsigned)(state % end);
}

/* Mostly text; `spice` of 8 bytes is anything. */
static void fill(uint8_t *bytes, size_t count, unsigned spice) {
    static const char text[] = "G1 X12.5Y-3\r\n?!~$[#](;";
    for (size_t n = 0; n < count; n++)
        bytes[n] = (uint8_t)(random_below(8) < spice ? random_below(256)
                                                     : (unsigned)text[random_below(sizeof text - 1)]);
}

static size_t put_each(struct rx *rx, const uint8_t *bytes, size_t count) {
    size_t n = 0;
    while (n < count && rx_put(rx, bytes[n]))
        n++;
    return n;
}

static void both_ways_are_one(void) {
    static struct rx each, all;
    unsigned differences = 0, full = 0;
    rx_init(&each);
    rx_init(&all);
    for (unsigned round = 0; round < ROUNDS; round++) {
        uint8_t bytes[MOST];
        const uint8_t *held;
        const size_t count = random_below(MOST + 1);
        fill(bytes, count, round % 9);
        const size_t taken = put_each(&each, bytes, count);
        differences += taken != rx_put_all(&all, bytes, count);
        full += taken < count;
        differences += memcmp(&each, &all, sizeof each) != 0;
        const size_t piece = rx_peek(&each, &held), drop = random_below((unsigned)piece + 1);
        rx_drop(&each, drop);
        rx_drop(&all, drop);
        differences += rx_take_realtime(&each) != rx_take_realtime(&all);
        if (random_below(20) == 0)
            rx_flush(&each), rx_flush(&all);
    }
    CHECK(differences == 0);
    CHECK(full > 100);
}

static void a_plain_byte_neither_acts_nor_ends_a_line(void) {
    for (unsigned byte = 0; byte < 256; byte++) {
        const char character = (char)byte;
        const bool plain = byte >= ' ' && byte != 0x7F && !net_line_is_realtime((uint8_t)byte);
        CHECK(net_line_plain_run(&character, 1) == plain);
    }
}

int main(void) {
    both_ways_are_one();
    a_plain_byte_neither_acts_nor_ends_a_line();
    return report();
}
