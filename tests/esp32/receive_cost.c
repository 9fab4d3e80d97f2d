/* SPDX-License-Identifier: MIT
 * What a byte of a serial port costs on an ESP32 before it is read as a line: lines of 25 bytes, 16 bytes a
 * read, through the Improv filter and the hub into the receive ring, for callgrind. Prints how many bytes. */
#include "input/rx.h"
#include "link/improv.h"
#include "net_hub.h"

#include <stdio.h>
#include <string.h>

enum { LINES = 4000, PIECE = 16 };

static const char line[] = "G1X12.345Y-6.789Z1.2F1500"; /* and its end */
static size_t sent;
static unsigned answers;
static struct rx rx;
static struct net_hub hub;

static long port_read(const struct net_stream *stream, char *bytes, size_t size) {
    size_t count = 0;
    (void)stream;
    for (; count < size && count < PIECE && sent < LINES * sizeof line; sent++)
        bytes[count++] = line[sent % sizeof line] != '\0' ? line[sent % sizeof line] : '\n';
    return (long)count;
}

static long port_write(const struct net_stream *stream, const char *bytes, size_t count) {
    (void)stream, (void)bytes;
    return (long)count;
}

static void port_close(const struct net_stream *stream) {
    (void)stream;
}

static uint32_t now_us(void *ctx) {
    (void)ctx;
    return 0;
}

static size_t put(void *ctx, const char *bytes, size_t count) {
    (void)ctx;
    return rx_put_all(&rx, (const uint8_t *)bytes, count);
}

static size_t hear(void *ctx, char *bytes, size_t size) {
    (void)ctx, (void)size;
    if (answers == 0)
        return 0;
    answers--;
    memcpy(bytes, "ok\r\n", 4);
    return 4;
}

static void act(void *ctx) {
    (void)ctx;
}

static enum machine_whose whose(void *ctx) {
    (void)ctx;
    return rx_aside(&rx) != RX_ASIDE_OPEN ? MACHINE_WHOSE_NONE : MACHINE_WHOSE_OPEN;
}

static uint8_t stops(void *ctx) {
    (void)ctx;
    return 0;
}

static size_t room(void *ctx) {
    (void)ctx;
    return rx_free(&rx);
}

static void event(void *ctx, const char *what, const char *who) {
    (void)ctx, (void)what, (void)who;
}

static size_t take(void) {
    const uint8_t *bytes;
    size_t count, total = 0;
    while ((count = rx_peek(&rx, &bytes)) > 0) {
        for (size_t n = 0; n < count; n++)
            answers += bytes[n] == '\n';
        rx_drop(&rx, count);
        total += count;
    }
    return total;
}

int main(void) {
    static const struct net_stream_ops port = {.read = port_read, .write = port_write, .close = port_close};
    static const struct improv_ops improv_ops = {.now_us = now_us};
    static const struct improv_info info = {"WiFiCNC", "1", "ESP32", "name"};
    static const struct net_hub_ops ops = {
        .put = put, .hear = hear, .act = act, .event = event, .whose = whose, .stops = stops, .room = room};
    static const struct net_hub_sizes sizes = {.clients = 1, .in = 2048, .out = 16384, .left = 2048};
    static struct improv improv;
    struct net_stream stream;
    size_t taken = 0;
    rx_init(&rx);
    net_hub_init(&hub, &sizes, &ops, NULL);
    improv_init(&improv, &(struct net_stream){.ops = &port}, &info, &improv_ops, &stream);
    (void)net_hub_connect(&hub, &stream, "UART");
    while (sent < LINES * sizeof line) {
        (void)net_hub_read(&hub, &hub.client[0]);
        while (net_hub_feed(&hub)) {
        }
        taken += take();
        net_hub_hear(&hub);
        net_hub_flush(&hub);
    }
    printf("{\"bytes\": %u, \"taken\": %u}\n", (unsigned)sent, (unsigned)taken);
    return taken == sent ? 0 : 1;
}
