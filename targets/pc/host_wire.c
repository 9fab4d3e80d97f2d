/* SPDX-License-Identifier: MIT */
#include "host_wire.h"

#include "base/version.h"
#include "host_device.h"
#include "host_inner.h"
#include "host_module.h"

#include <stdlib.h>
#include <string.h>

enum { EVENTS_A_ROUND = 1 << 20 };

/* A datagram on its way out. */
struct sent {
    struct sent *next;
    struct session_peer to;
    size_t size;
    uint8_t bytes[WIRE_PACKET_MAX];
};

struct host_wire {
    struct host *host;
    struct session session;
    struct host_module module;
    struct host_device device;
    struct sent *first, **last;
    uint64_t seed;
    struct access access;
};

static void address_bytes(uint32_t address, uint8_t bytes[4]) {
    for (unsigned i = 0; i < 4; i++)
        bytes[i] = (uint8_t)(address >> (24 - 8 * i));
}

static void keep_sent(void *ctx, const struct session_peer *to, const uint8_t *packet, size_t size) {
    struct host_wire *wire = ctx;
    struct sent *sent = malloc(sizeof *sent);
    if (sent == NULL)
        return; /* lost, as datagrams may be */
    *sent = (struct sent){.to = *to, .size = size};
    memcpy(sent->bytes, packet, size);
    /* `last` is where the next one is linked in: appending needs no walk through the list. */
    *wire->last = sent;
    wire->last = &sent->next;
}

/* Virtual time repeats itself, and so do these. */
static void repeatable(void *ctx, uint8_t *bytes, size_t count) {
    struct host_wire *wire = ctx;
    for (size_t i = 0; i < count; i++) {
        wire->seed = wire->seed * 6364136223846793005u + 1442695040888963407u; /* Knuth's MMIX */
        bytes[i] = (uint8_t)(wire->seed >> 56);
    }
}

static struct host_wire *create(struct host *host, const char *key, bool is_module) {
    static const struct session_ops ops = {.send = keep_sent, .random = repeatable};
    uint8_t salt[ACCESS_SALT];
    struct host_wire *wire = calloc(1, sizeof *wire);
    if (wire == NULL)
        return NULL;
    wire->host = host;
    wire->last = &wire->first;
    repeatable(wire, salt, sizeof salt);
    access_init(&wire->access, key, key[0] == '\0', salt, hal_time_us(&host->hal));
    host_module_init(&wire->module, host);
    host_device_init(&wire->device, host);
    const struct session_options options = {.name = "WiFiCNC",
                                            .access = &wire->access,
                                            .version = VERSION_WORD,
                                            .status_port = WIRE_STATUS_PORT,
                                            .channels = &wire->module.channels,
                                            .device = &wire->device.device};
    if (!is_module && !channels_are_chosen(&wire->module.channels)) {
        session_init(&wire->session, &host->machine, &options, &ops, wire);
        return wire;
    }
    host_module_start(&wire->module);
    session_init_module(&wire->session, &wire->module.device, &options, &ops, wire);
    return wire;
}

struct host_wire *host_wire_create(struct host *host, const char *key) {
    return create(host, key, false);
}

struct host_wire *host_wire_create_module(struct host *host, const char *key) {
    return create(host, key, true);
}

unsigned host_wire_joined(const struct host_wire *wire) {
    return wire->device.joined;
}

void host_wire_trust(struct host_wire *wire, uint32_t address, int span) {
    uint8_t bytes[4];
    address_bytes(address, bytes);
    (void)access_trust(&wire->access, lockout_ipv4(bytes), (enum access_span)span);
}

bool host_wire_hold(struct host_wire *wire, unsigned pin, int hold) {
    return host_module_hold(&wire->module, pin, (enum module_hold)hold);
}

uint64_t host_wire_levels(const struct host_wire *wire, uint64_t *driven) {
    *driven = wire->module.driven;
    return wire->module.level;
}

void host_wire_destroy(struct host_wire *wire) {
    for (struct sent *next; wire->first != NULL; wire->first = next) {
        next = wire->first->next;
        free(wire->first);
    }
    free(wire);
}

static void tell_observer(const struct host_wire *wire) {
    const struct host_observer *observer = &wire->host->observer;
    if (observer->asked != NULL)
        observer->asked(observer->ctx);
}

void host_wire_datagram(struct host_wire *wire, uint32_t address, uint16_t port, const uint8_t *bytes,
                        size_t size) {
    struct session_peer from = {.port = port};
    address_bytes(address, from.address);
    tell_observer(wire);
    session_datagram(&wire->session, &from, bytes, size);
}

void host_wire_unreachable(struct host_wire *wire, uint32_t address, uint16_t port) {
    struct session_peer at = {.port = port};
    address_bytes(address, at.address);
    session_unreachable(&wire->session, &at);
}

size_t host_wire_sent(struct host_wire *wire, uint32_t *address, uint16_t *port, uint8_t *bytes,
                      size_t size) {
    struct sent *sent = wire->first;
    if (sent == NULL)
        return 0;
    size_t count = sent->size < size ? sent->size : size;
    const uint8_t *to = sent->to.address;
    *address = (uint32_t)to[0] << 24 | (uint32_t)to[1] << 16 | (uint32_t)to[2] << 8 | to[3];
    *port = sent->to.port;
    memcpy(bytes, sent->bytes, count);
    wire->first = sent->next;
    if (wire->first == NULL)
        wire->last = &wire->first;
    free(sent);
    return count;
}

int host_wire_connect(struct host_wire *wire, uint32_t address) {
    uint8_t bytes[4];
    int place = session_place(&wire->session);
    if (place < 0)
        return -1;
    if (wire->session.client[place].used)
        session_disconnect(&wire->session, place, false);
    address_bytes(address, bytes);
    session_connect(&wire->session, place, bytes);
    return place;
}

void host_wire_disconnect(struct host_wire *wire, int client) {
    session_disconnect(&wire->session, client, true);
}

size_t host_wire_request(struct host_wire *wire, int client, const uint8_t *message, size_t size,
                         uint8_t *reply) {
    if (session_must_wait(&wire->session, client, message, size))
        return 0;
    tell_observer(wire);
    return session_request(&wire->session, client, message, size, reply);
}

void host_wire_run(struct host_wire *wire, uint64_t t_ticks) {
    struct host *host = wire->host;
    /* A session is polled each ms here, which is what a module needs (session.h). */
    uint64_t ms_ticks = host->hal.timer_hz / 1000;
    for (uint64_t now; (now = host_time_ticks(host)) < t_ticks;) {
        uint64_t until = now + ms_ticks < t_ticks ? now + ms_ticks : t_ticks;
        while (host_time_ticks(host) < until)
            (void)host_run_paced(host, until, EVENTS_A_ROUND);
        now = host_time_ticks(host);
        if (tasks_stalled_until(&host->tasks, HOST_CONTROLLER, now) > now)
            continue; /* it is the controller's task that does this */
        access_poll(&wire->access, hal_time_us(&host->hal));
        session_poll(&wire->session);
        tasks_wake(&host->tasks, now);
    }
}
