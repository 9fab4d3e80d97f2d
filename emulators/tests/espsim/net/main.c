/* SPDX-License-Identifier: MIT
 * A computer behind a W5500 for tests of the virtual ESP32, without an operating system and without memory of
 * who calls: 10.0.2.15 answers ARP and ping, sends back each datagram, and takes each TCP call and returns
 * its bytes. SPI3 by its buffer; data sheet W5500, socket 0 in MACRAW mode. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* Technical reference manual, SPI. */
#define SPI(offset) (*(volatile uint32_t *)(0x3FF65000 + (offset)))
#define SPI_BUFFER  ((volatile uint32_t *)0x3FF65080)
enum {
    CMD = 0x00,
    ADDRESS = 0x04,
    CLOCK = 0x18,
    USER = 0x1C,
    USER1 = 0x20,
    USER2 = 0x24,
    OUT_BITS = 0x28,
    IN_BITS = 0x2C
};
enum { START = 1 << 18, DUPLEX = 1, HAS_BOTH = 3 << 27, MHZ_20 = 3 << 12, BUFFER_SIZE = 64 };
#define HAS_HEAD (3u << 30)

enum { COMMON, SOCKET, TX, RX };
enum {
    MODE = 0x00,
    COMMAND = 0x01,
    RX_SIZE = 0x1E,
    TX_SIZE = 0x1F,
    TX_WRITE = 0x24,
    RX_COUNT = 0x26,
    RX_READ = 0x28
};
enum { OPEN = 0x01, SEND = 0x20, RECEIVE = 0x40, MACRAW = 4, FILTERED = 1 << 7, ALL_KB = 16 };

enum { ETHERNET = 14, IP = 34, FRAME_MAX = 1514, ICMP = 1, TCP = 6, UDP = 17 };
enum { FIN = 1, SYN = 2, PUSH = 8, ACK = 16, FIRST_NUMBER = 1000, WINDOW = 1400 };

static uint8_t own_mac[6] = {0x02, 0x08, 0xDC, 0x01, 0x02, 0x03};
static const uint8_t own_address[4] = {10, 0, 2, 15};
static uint8_t frame[FRAME_MAX + 2];
volatile uint32_t frames; /* taken, for the test */

/* ---- the W5500 ---- */

static void transfer(unsigned block, uint16_t at, uint8_t *bytes, size_t count, bool writes) {
    uint32_t words[BUFFER_SIZE / 4] = {0};
    if (writes)
        memcpy(words, bytes, count);
    for (size_t i = 0; i < (count + 3) / 4; i++)
        SPI_BUFFER[i] = words[i];
    SPI(USER) = DUPLEX | HAS_BOTH | HAS_HEAD;
    SPI(USER1) = 7u << 26;
    SPI(USER2) = 15u << 28 | (uint32_t)(at >> 8 | (at & 0xFF) << 8);
    SPI(ADDRESS) = (block << 3 | (writes ? 4u : 0)) << 24;
    SPI(OUT_BITS) = SPI(IN_BITS) = 8 * count - 1;
    SPI(CMD) = START;
    while (SPI(CMD) != 0) {
    }
    for (size_t i = 0; i < (count + 3) / 4; i++)
        words[i] = SPI_BUFFER[i];
    if (!writes)
        memcpy(bytes, words, count);
}

static void move(unsigned block, uint16_t at, uint8_t *bytes, size_t count, bool writes) {
    for (size_t done = 0; done < count; done += BUFFER_SIZE) {
        const size_t size = count - done < BUFFER_SIZE ? count - done : BUFFER_SIZE;
        transfer(block, (uint16_t)(at + done), bytes + done, size, writes);
    }
}

static void set(unsigned block, uint16_t at, uint8_t value) {
    move(block, at, &value, 1, true);
}

static uint16_t get_word(uint16_t at) {
    uint8_t word[2];
    move(SOCKET, at, word, 2, false);
    return (uint16_t)(word[0] << 8 | word[1]);
}

static void set_word(uint16_t at, uint16_t value) {
    uint8_t word[2] = {(uint8_t)(value >> 8), (uint8_t)value};
    move(SOCKET, at, word, 2, true);
}

static void begin(void) {
    SPI(CLOCK) = MHZ_20;
    move(COMMON, 0x09, own_mac, 6, true);
    set(SOCKET, RX_SIZE, ALL_KB);
    set(SOCKET, TX_SIZE, ALL_KB);
    set(SOCKET, MODE, MACRAW | FILTERED);
    set(SOCKET, COMMAND, OPEN);
}

/* @return its size; 0: none */
static size_t take_frame(void) {
    if (get_word(RX_COUNT) == 0)
        return 0;
    const uint16_t at = get_word(RX_READ);
    uint8_t head[2];
    move(RX, at, head, 2, false);
    const uint16_t whole = (uint16_t)(head[0] << 8 | head[1]);
    move(RX, (uint16_t)(at + 2), frame, whole - 2u, false);
    set_word(RX_READ, (uint16_t)(at + whole));
    set(SOCKET, COMMAND, RECEIVE);
    return whole - 2u;
}

/* Back to who has sent the one that is there. */
static void send_frame(size_t size) {
    const uint16_t at = get_word(TX_WRITE);
    memcpy(frame, frame + 6, 6);
    memcpy(frame + 6, own_mac, 6);
    move(TX, at, frame, size, true);
    set_word(TX_WRITE, (uint16_t)(at + size));
    set(SOCKET, COMMAND, SEND);
}

/* ---- packets ---- */

static uint16_t word(size_t at) {
    return (uint16_t)(frame[at] << 8 | frame[at + 1]);
}

static void put(size_t at, uint32_t value, unsigned bytes) {
    for (unsigned i = 0; i < bytes; i++)
        frame[at + i] = (uint8_t)(value >> 8 * (bytes - 1 - i));
}

/* RFC 1071, of bytes of the frame, and what else belongs to the sum. */
static uint16_t checksum(size_t from, size_t to, uint32_t sum) {
    for (size_t at = from; at < to; at++)
        sum += (uint32_t)frame[at] << ((at - from) % 2 == 0 ? 8 : 0);
    while (sum > 0xFFFF)
        sum = (sum & 0xFFFF) + (sum >> 16);
    return (uint16_t)~sum;
}

static void swap(size_t first, size_t second, size_t count) {
    for (size_t i = 0; i < count; i++) {
        const uint8_t kept = frame[first + i];
        frame[first + i] = frame[second + i];
        frame[second + i] = kept;
    }
}

static void answer_arp(void) {
    if (word(20) != 1 || memcmp(frame + 38, own_address, 4) != 0)
        return;
    put(20, 2, 2);
    memcpy(frame + 32, frame + 22, 10);
    memcpy(frame + 22, own_mac, 6);
    memcpy(frame + 28, own_address, 4);
    send_frame(42);
}

/* The whole state of a call is in its segment: we continue where the caller expects it. */
static size_t answer_tcp(size_t end) {
    const size_t data = IP + (size_t)(frame[46] >> 4) * 4, count = end - data;
    const uint8_t flags = frame[47];
    const uint32_t number = (uint32_t)word(38) << 16 | word(40),
                   expected = (uint32_t)word(42) << 16 | word(44);
    const bool begins = (flags & SYN) != 0, ends = (flags & FIN) != 0;
    if (count == 0 && !begins && !ends)
        return 0;
    memmove(frame + IP + 20, frame + data, count);
    swap(IP, IP + 2, 2);
    put(38, begins ? FIRST_NUMBER : expected, 4);
    put(42, number + (uint32_t)count + begins + ends, 4);
    put(46, 5u << 12 | ACK | (begins ? SYN : 0u) | (count != 0 ? PUSH : 0u) | (ends ? FIN : 0u), 2);
    put(48, WINDOW, 2);
    put(50, 0, 4);
    put(50, checksum(26, IP + 20 + count, TCP + 20 + (uint32_t)count), 2);
    return IP + 20 + count;
}

static void answer_ip(void) {
    size_t end = ETHERNET + (size_t)word(16);
    if (frame[ETHERNET] != 0x45 || memcmp(frame + 30, own_address, 4) != 0 || end > FRAME_MAX)
        return;
    swap(26, 30, 4);
    if (frame[23] == ICMP && frame[IP] == 8) {
        put(IP, 0, 2);
        put(36, 0, 2);
        put(36, checksum(IP, end, 0), 2);
    } else if (frame[23] == UDP)
        swap(IP, IP + 2, 2);
    else if (frame[23] != TCP || (end = answer_tcp(end)) == 0)
        return;
    put(16, (uint32_t)(end - ETHERNET), 2);
    put(24, 0, 2);
    put(24, checksum(ETHERNET, IP, 0), 2);
    send_frame(end);
}

int main(void) {
    begin();
    for (;;) {
        if (take_frame() == 0)
            continue;
        frames = frames + 1;
        if (word(12) == 0x0806)
            answer_arp();
        else if (word(12) == 0x0800)
            answer_ip();
    }
}
