/* SPDX-License-Identifier: MIT
 * Improv over a serial port: packets are taken out of the stream and answered between two lines, whatever
 * else comes by, and however the bytes were cut. */
#include "link/improv.h"

#include "check.h"

#include <string.h>

/* The port, the network and the clock. */
static struct {
    char in[1024], out[2048];
    size_t in_count, in_read, out_count, chunk, room;
    char network[64], password[80];
    bool accepts, joined, scanned;
    unsigned joins;
    uint32_t now_us;
} world;

static struct improv improv;
static struct net_stream stream;

static long port_read(const struct net_stream *port, char *bytes, size_t size) {
    (void)port;
    size_t count = world.in_count - world.in_read;
    count = count < size ? count : size;
    count = count < world.chunk ? count : world.chunk;
    memcpy(bytes, world.in + world.in_read, count);
    world.in_read += count;
    return (long)count;
}

static long port_write(const struct net_stream *port, const char *bytes, size_t count) {
    (void)port;
    count = count < world.room ? count : world.room;
    memcpy(world.out + world.out_count, bytes, count);
    world.out_count += count;
    world.room -= count;
    return (long)count;
}

static void port_close(const struct net_stream *port) {
    (void)port;
}

static bool net_join(void *ctx, const char *network, const char *password) {
    (void)ctx;
    world.joins++;
    snprintf(world.network, sizeof world.network, "%s", network);
    snprintf(world.password, sizeof world.password, "%s", password);
    return world.accepts;
}

static bool net_joined(void *ctx, char *address) {
    (void)ctx;
    strcpy(address, "tcp://192.168.1.20:23");
    return world.joined;
}

static bool net_scan(void *ctx) {
    (void)ctx;
    return world.accepts;
}

static enum improv_scan net_scanned(void *ctx, size_t index, struct improv_network *network) {
    static const struct improv_network found[] = {{"Kitchen", -41, true}, {"Guest room", -77, false}};
    (void)ctx;
    if (!world.scanned)
        return IMPROV_SCANNING;
    if (index >= sizeof found / sizeof found[0])
        return IMPROV_NO_MORE;
    *network = found[index];
    return IMPROV_NETWORK;
}

static uint32_t clock_us(void *ctx) {
    (void)ctx;
    return world.now_us;
}

static void begin(size_t chunk) {
    static const struct net_stream_ops port_ops = {
        .read = port_read, .write = port_write, .close = port_close};
    static const struct improv_ops ops = {
        .join = net_join, .joined = net_joined, .scan = net_scan, .scanned = net_scanned, .now_us = clock_us};
    static const struct improv_info info = {"WiFiCNC", "1.0", "ESP32-S3", "WiFiCNC-1A2B"};
    memset(&world, 0, sizeof world);
    world.chunk = chunk;
    world.room = sizeof world.out;
    world.accepts = true;
    world.now_us = UINT32_MAX - 1000;
    improv_init(&improv, &(struct net_stream){.ops = &port_ops, .local = true}, &info, &ops, &stream);
}

static void type_bytes(const void *bytes, size_t count) {
    memcpy(world.in + world.in_count, bytes, count);
    world.in_count += count;
}

static void send_packet(uint8_t type, const void *data, uint8_t size) {
    uint8_t packet[300] = "IMPROV\x01", total = 0;
    packet[7] = type;
    packet[8] = size;
    memcpy(packet + 9, data, size);
    for (size_t i = 0; i < 9u + size; i++)
        total = (uint8_t)(total + packet[i]);
    packet[9 + size] = total;
    type_bytes(packet, 10u + size);
}

/* All that has come, as the hub reads it. */
static const char *heard(void) {
    static char text[1024];
    size_t count = 0;
    for (size_t idle = 0; idle < 4;) {
        long got = stream.ops->read(&stream, text + count, 64);
        count += got > 0 ? (size_t)got : 0;
        idle = got > 0 || world.in_read < world.in_count ? 0 : idle + 1;
    }
    text[count] = '\0';
    return text;
}

/* The packet of this type that was sent last. @return its data, *size of them; NULL: none */
static const uint8_t *said(uint8_t type, size_t *size) {
    const uint8_t *found = NULL;
    for (size_t i = 0; i + 10 <= world.out_count; i++) {
        const uint8_t *at = (const uint8_t *)world.out + i;
        if (memcmp(at, "IMPROV\x01", 7) != 0 || at[7] != type)
            continue;
        uint8_t total = 0;
        for (size_t n = 0; n < 9u + at[8]; n++)
            total = (uint8_t)(total + at[n]);
        CHECK(at[9 + at[8]] == total && at[10 + at[8]] == '\n' && (i == 0 || at[-1] == '\n'));
        *size = at[8];
        found = at + 9;
    }
    return found;
}

static bool says(uint8_t type, const void *data, size_t size) {
    size_t got;
    const uint8_t *found = said(type, &got);
    return found != NULL && got == size && memcmp(found, data, size) == 0;
}

static const char credentials[] = "\x01\x11\x07Kitchen\x08-!?~\x18\x85Pw";

static void a_packet_among_lines(void) {
    for (size_t chunk = 1; chunk < 40; chunk++) {
        begin(chunk);
        type_bytes("G1X1\n", 5);
        send_packet(3, "\x02\0", 2);
        type_bytes("?\nG2I1IMPIMPROX\n", 16);
        CHECK(strcmp(heard(), "G1X1\n?\nG2I1IMPIMPROX\n") == 0);
        CHECK(says(1, "\x02", 1));
    }
}

static void a_network_is_joined(void) {
    begin(7);
    send_packet(3, credentials, sizeof credentials - 1);
    CHECK(heard()[0] == '\0'); /* the real-time bytes of the password are none */
    CHECK(strcmp(world.network, "Kitchen") == 0 && strcmp(world.password, "-!?~\x18\x85Pw") == 0);
    CHECK(says(1, "\x03", 1) && says(2, "\0", 1));
    world.now_us += 29000000;
    world.joined = true;
    (void)heard();
    CHECK(says(1, "\x04", 1) && says(4, "\x01\x16\x15tcp://192.168.1.20:23", 24));
    send_packet(3, "\x02\0", 2);
    (void)heard();
    CHECK(says(4, "\x02\x16\x15tcp://192.168.1.20:23", 24));
}

static void a_network_that_is_not_there(void) {
    begin(64);
    send_packet(3, credentials, sizeof credentials - 1);
    (void)heard();
    world.now_us += 30000000;
    (void)heard();
    CHECK(says(2, "\x03", 1) && says(1, "\x02", 1));
}

static void turn(void) {
    char text[64];
    CHECK(stream.ops->read(&stream, text, sizeof text) == 0);
}

static void networks_are_listed_one_by_one_and_the_list_ends(void) {
    begin(64);
    send_packet(3, "\x04\0", 2);
    (void)heard();
    CHECK(world.out_count == 0);
    world.scanned = true;
    turn();
    CHECK(says(4, "\x04\x10\x07Kitchen\x03-41\x03YES", 18));
    turn();
    CHECK(says(4, "\x04\x12\x0AGuest room\x03-77\x02NO", 20));
    turn();
    CHECK(says(4, "\x04\0", 2));
    size_t all = world.out_count;
    turn();
    CHECK(world.out_count == all);
}

static void a_look_that_never_ends_is_given_up_and_one_that_may_not_begin_is_refused(void) {
    begin(64);
    send_packet(3, "\x04\0", 2);
    (void)heard();
    world.now_us += 15000000;
    (void)heard();
    CHECK(says(4, "\x04\0", 2));
    world.accepts = false;
    send_packet(3, "\x04\0", 2);
    (void)heard();
    CHECK(says(2, "\xFF", 1));
}

static void a_machine_that_moves_refuses(void) {
    begin(64);
    world.accepts = false;
    send_packet(3, credentials, sizeof credentials - 1);
    (void)heard();
    CHECK(says(2, "\xFF", 1));
}

static void information(void) {
    size_t size = 0;
    begin(64);
    send_packet(3, "\x03\0", 2);
    (void)heard();
    const uint8_t *data = said(4, &size);
    static const char expected[] = "\x03\x26\x07WiFiCNC\x03"
                                   "1.0\x08"
                                   "ESP32-S3\x0CWiFiCNC-1A2B";
    CHECK(data != NULL && size >= 2 && data[1] == size - 2 && memcmp(data + 2, expected + 2, size - 2) == 0);
}

static void wrong_packets_change_nothing(void) {
    static const struct {
        const char *data;
        uint8_t size, error;
    } wrong[] = {
        {"\x01\x02\x01N", 4, 1},             /* no password at all */
        {"\x01\x0A\x00\x08password", 12, 1}, /* no name */
        {"\x01\x04\x01N\x01p", 6, 1},        /* a password of one letter */
        {"\x01\x04\x7FN\x01p", 6, 1},        /* a length beyond the end */
        {"\x01\x05\x02N\0\x01p", 7, 1},      /* a NUL in the name */
        {"\x02", 1, 1},
        {"\x02\x05", 2, 1}, /* too short, and shorter than it says */
        {"\x09\0", 2, 2},   /* no such command */
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        begin(64);
        send_packet(3, wrong[i].data, wrong[i].size);
        CHECK(heard()[0] == '\0' && says(2, &wrong[i].error, 1) && world.joins == 0);
    }
    begin(64);
    send_packet(3, credentials, sizeof credentials - 1);
    world.in[20] ^= 1;
    (void)heard();
    CHECK(says(2, "\x01", 1) && world.joins == 0);
}

static void half_a_packet_does_not_make_the_port_deaf(void) {
    begin(64);
    type_bytes("IMPROV\x01\x03\x40", 9);
    (void)heard();
    world.now_us += 500000;
    type_bytes("G0X1\n", 5);
    CHECK(strcmp(heard(), "G0X1\n") == 0);
}

static void answers_stand_between_lines_even_at_a_slow_port(void) {
    begin(64);
    CHECK(stream.ops->write(&stream, "<Idle|", 6) == 6);
    send_packet(3, "\x02\0", 2);
    (void)heard();
    CHECK(world.out_count == 6); /* in the middle of a line nothing is reported */
    CHECK(stream.ops->write(&stream, "MPos:0>\r\n", 9) == 9);
    world.room = 5;
    CHECK(stream.ops->write(&stream, "ok\r\n", 4) == 0); /* half a packet is out: the line waits */
    world.room = 100;
    CHECK(stream.ops->write(&stream, "ok\r\n", 4) == 4);
    CHECK(says(1, "\x02", 1) && memcmp(world.out + world.out_count - 4, "ok\r\n", 4) == 0);
}

int main(void) {
    a_packet_among_lines();
    a_network_is_joined();
    a_network_that_is_not_there();
    networks_are_listed_one_by_one_and_the_list_ends();
    a_look_that_never_ends_is_given_up_and_one_that_may_not_begin_is_refused();
    a_machine_that_moves_refuses();
    information();
    wrong_packets_change_nothing();
    half_a_packet_does_not_make_the_port_deaf();
    answers_stand_between_lines_even_at_a_slow_port();
    return report();
}
