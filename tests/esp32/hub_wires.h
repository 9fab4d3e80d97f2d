/* SPDX-License-Identifier: MIT
 * A hub with clients that are buffers, and a controller that notes what it gets. */
#ifndef WIFICNC_TESTS_ESP32_HUB_WIRES_H
#define WIFICNC_TESTS_ESP32_HUB_WIRES_H

#include "access/access.h"
#include "check.h"
#include "net_hub.h"

#include <string.h>

enum { HUB_WIRES = 256 };

struct wire {
    char in[512], out[20000];
    size_t in_count, out_count;
    bool closed, ended, damaged; /* ended: no more comes, but it hears */
};

static struct access the_gate;
static char got[1024], says[512];
static size_t got_count;
static unsigned owners_left;
static bool full, waited, left_before_lines; /* ... : no line had come since fresh_lines() */
static uint32_t clock_us;
static const struct wire *stuck; /* takes no bytes */

static long wire_read(const struct net_stream *stream, char *bytes, size_t size) {
    struct wire *wire = stream->ctx;
    if (wire->damaged) {
        wire->damaged = false;
        return NET_UNFRAMED;
    }
    size_t count = wire->in_count < size ? wire->in_count : size;
    memcpy(bytes, wire->in, count);
    memmove(wire->in, wire->in + count, wire->in_count -= count);
    if (count == 0 && wire->ended)
        return NET_ENDED;
    return wire->closed ? NET_GONE : (long)count;
}

static long wire_write(const struct net_stream *stream, const char *bytes, size_t count) {
    struct wire *wire = stream->ctx;
    const size_t room = sizeof wire->out - 1 - wire->out_count;
    if (wire == stuck)
        return 0;
    if (count > room)
        count = room;
    memcpy(wire->out + wire->out_count, bytes, count);
    wire->out[wire->out_count += count] = '\0';
    return (long)count;
}

static void count_lost(void *ctx, long what) {
    (void)ctx;
    (void)what;
}

static void wire_close(const struct net_stream *stream) {
    ((struct wire *)stream->ctx)->closed = true;
}

static size_t put(void *ctx, const char *bytes, size_t count) {
    (void)ctx;
    if (full)
        return 0;
    memcpy(got + got_count, bytes, count);
    got[got_count += count] = '\0';
    return count;
}

static size_t hear(void *ctx, char *bytes, size_t size) {
    size_t count = strlen(says);
    (void)ctx;
    (void)size;
    memcpy(bytes, says, count);
    says[0] = '\0';
    return count;
}

static void act(void *ctx) {
    (void)ctx;
}

static void event(void *ctx, const char *what, const char *who) {
    (void)ctx;
    (void)what;
    (void)who;
}

static void left(void *ctx, bool lines_wait) {
    (void)ctx;
    owners_left++;
    waited = lines_wait;
    left_before_lines = got_count == 0;
}

static enum machine_reads now_reads;
static bool shows_mpg;

static enum machine_reads reads(void *ctx) {
    (void)ctx;
    return now_reads;
}

static unsigned pendants_left;

static void pendant_left(void *ctx) {
    (void)ctx;
    pendants_left++;
}

static void show_mpg(void *ctx, bool on) {
    (void)ctx;
    shows_mpg = on;
}

static uint8_t pressed;

static uint8_t presses(void *ctx) {
    (void)ctx;
    return pressed;
}

static inline void begin(struct access *access, const char *key) {
    static const uint8_t salt[ACCESS_SALT];
    access_init(access, key, key[0] == '\0', salt, 0);
}

static struct net_hub hub;
static struct wire wires[HUB_WIRES];

/* @param clients  places of the hub */
static inline void start_hub(const char *key, size_t clients) {
    static const struct net_hub_ops ops = {.put = put,
                                           .lost = count_lost,
                                           .hear = hear,
                                           .act = act,
                                           .event = event,
                                           .left = left,
                                           .presses = presses,
                                           .reads = reads,
                                           .pendant_left = pendant_left,
                                           .mpg = show_mpg};
    const struct net_hub_sizes sizes = {.clients = clients, .in = 2048, .out = 16384, .left = 2048};
    net_hub_close(&hub);
    begin(&the_gate, key);
    memset(wires, 0, sizeof wires);
    got_count = owners_left = pendants_left = 0;
    full = waited = shows_mpg = false;
    now_reads = MACHINE_READS_LINES;
    got[0] = '\0';
    clock_us = pressed = 0;
    stuck = NULL;
    net_hub_init(&hub, &sizes, &ops, NULL);
    hub.access = &the_gate;
}

/* @param host  of IPv6, else 0 */
static inline bool come_by(unsigned n, uint64_t peer, uint64_t host, bool local) {
    static const struct net_stream_ops ops = {.read = wire_read, .write = wire_write, .close = wire_close};
    const struct net_stream stream = {
        .ops = &ops, .ctx = &wires[n], .peer = peer, .host = host, .local = local};
    memset(&wires[n], 0, sizeof wires[n]);
    return net_hub_connect(&hub, &stream, "client");
}

static inline bool come_from(unsigned n, uint64_t peer, bool local) {
    return come_by(n, peer, 0, local);
}

static inline void round_trip(void) {
    access_poll(&the_gate, clock_us);
    net_hub_tick(&hub, clock_us);
    for (struct net_client *client = hub.client; client < hub.client + NET_CLIENTS; client++)
        if (net_hub_wants_read(&hub, client))
            net_hub_read(&hub, client);
    net_hub_ask(&hub);
    (void)net_hub_feed(&hub);
    net_hub_hear(&hub);
    net_hub_flush(&hub);
}

/* A hub with three places. */
static inline void start(const char *key) {
    start_hub(key, 3);
}

/* Clients 0 and 3 have one address. */
static inline bool come(unsigned n, bool local) {
    return come_from(n, n == 3 ? 1 : n + 1, local);
}

/* It has come, and is not read yet. */
static inline void put_on_wire(unsigned n, const char *text) {
    wires[n].in_count = strlen(text);
    memcpy(wires[n].in, text, wires[n].in_count);
}

static inline void send(unsigned n, const char *text) {
    put_on_wire(n, text);
    wires[n].out_count = 0;
    wires[n].out[0] = '\0';
    round_trip();
}

#endif
