/* SPDX-License-Identifier: MIT
 * Of the harness tcp.c alone: connections that are buffers, datagrams, and net_wire.c with these in place of
 * sockets; and what each connection gets is checked here. */
#ifndef WIFICNC_TESTS_FUZZ_TCP_NETWORK_H
#define WIFICNC_TESTS_FUZZ_TCP_NETWORK_H

#include "fuzz.h"

#include "host_inner.h"
#include "wire/bytes.h"
#include "wire/packet.h"
#include "wire/seal.h"

#include <string.h>

/* The sockets of net_wire.c are those of this file, and it is here for the second time. */
#define net_tcp_accept               fuzz_accept
#define net_tcp_keep_alive           fuzz_keep_alive
#define net_tcp_listen               fuzz_listen
#define net_socket_peer              fuzz_peer
#define net_socket_udp               fuzz_udp
#define net_socket_receive           fuzz_receive
#define net_socket_send              fuzz_send
#define net_socket_close             fuzz_close
#define net_socket_watch_unreachable fuzz_watch
#define net_socket_unreachable       fuzz_unreachable
#define net_wire_open                fuzz_wire_open
#define net_wire_close               fuzz_wire_close
#define net_wire_round               fuzz_wire_round
#define net_wire_send                fuzz_wire_send
#define net_wire_wants_read          fuzz_wire_wants_read
#include "net_wire.c"

enum { HZ = 1000000, WIRES = 12, ADDRESSES = 4, OTHERS = 2, THINGS_MAX = 160, MS_MAX = 8000 };
enum { STREAM_IN = 2048, REPLY_FRAME = 2 + WIRE_PACKET_MAX, OVERHEARD = 4, ALL = 1 << 16 };
enum { SILENT_S = WIRE_CLIENT_IDLE_S, LOGIN_MS = 30000, GUESSES_MAX = 10, WAIT_MS = (SILENT_S + 20) * 1000 };

struct connection {
    uint8_t in[STREAM_IN];
    size_t in_count;
    uint8_t reply[REPLY_FRAME];
    size_t reply_count;
    uint8_t address;
    unsigned cut, takes;          /* bytes that a read gets, a write places; ALL: all */
    unsigned asked, pings, pongs; /* good messages so far, those with a number, their replies */
    unsigned replied;
    bool open, waits; /* waits: in the backlog */
    bool ended;       /* we have sent the end */
    bool failed;      /* we have broken it off */
    bool bad;         /* we have sent a length that cannot be */
    bool has_nonce, proves, knows;
    uint8_t nonce[SEAL_NONCE], key[SIPHASH_KEY];
    struct seal seal;
};

struct packet {
    uint8_t bytes[WIRE_PACKET_MAX];
    size_t size;
};

static struct scene {
    struct host *host;
    struct session session;
    struct net_wire net;
    struct access access;
    struct connection connection[WIRES];
    struct packet overheard[OVERHEARD], datagram;
    uint8_t datagram_from, closed; /* closed: an ICMP error of this address, 0: none */
    unsigned overheard_count;
    size_t came[ADDRESSES + OTHERS], went[ADDRESSES + OTHERS];
    bool connected[ADDRESSES + OTHERS];
    uint32_t sequence, interval_ms;
    bool locks, any_proved;
    uint32_t steps, random;
} scene;

static const char the_key[] = "correct horse";

/* ---- addresses: 10.0.0.n; the last ones have no connections ---- */

static void address_of(unsigned n, uint8_t bytes[4]) {
    memcpy(bytes, (const uint8_t[]){10, 0, 0, (uint8_t)n}, 4);
}

static uint64_t peer_of(unsigned n) {
    uint8_t bytes[4];
    address_of(n, bytes);
    return lockout_ipv4(bytes);
}

/* ---- what a connection says and hears ---- */

static bool has_room(const struct connection *wire, size_t count) {
    return wire->open && !wire->ended && !wire->failed && wire->in_count + count <= sizeof wire->in;
}

static void say(struct connection *wire, const uint8_t *bytes, size_t count) {
    if (!has_room(wire, count))
        return;
    memcpy(wire->in + wire->in_count, bytes, count);
    wire->in_count += count;
}

static void say_frame(struct connection *wire, const uint8_t *message, size_t size) {
    uint8_t frame[2 + WIRE_CONTROL_MAX];
    put_u16(frame, (uint16_t)size);
    memcpy(frame + 2, message, size);
    say(wire, frame, 2 + size);
}

/* A good message, whose payload is in place. */
static void ask(struct connection *wire, uint8_t *message, uint8_t type, size_t payload) {
    size_t size = wire_close(message, type, payload, ++scene.sequence, 1);
    if (wire->bad || !has_room(wire, 2 + size))
        return;
    wire->asked++;
    say_frame(wire, message, size);
}

static void hear(struct connection *wire, const uint8_t *packet, size_t size) {
    struct wire_header header;
    const uint8_t *payload = packet + WIRE_HEADER_SIZE;
    CLAIM(wire_open(packet, size, &header) && size == (size_t)WIRE_HEADER_SIZE + header.length,
          "a reply is no packet");
    wire->replied++;
    CLAIM(wire->replied <= wire->asked, "%u replies to %u messages", wire->replied, wire->asked);
    if (header.type == WIRE_PONG) {
        CLAIM(get_u32(payload) == ++wire->pongs, "pong %u comes as number %u", get_u32(payload), wire->pongs);
        CLAIM(wire->pongs <= wire->pings, "a pong without a ping");
    } else if (header.type == WIRE_CHALLENGE_RESPONSE) {
        CLAIM(!wire->has_nonce || memcmp(wire->nonce, payload, SEAL_NONCE) != 0, "a nonce comes twice");
        memcpy(wire->nonce, payload, SEAL_NONCE);
        wire->has_nonce = true;
    } else if (header.type == WIRE_AUTHENTICATED) {
        CLAIM(wire->proves || !scene.locks, "a wrong proof was accepted");
        wire->knows = wire->proves;
        wire->seal = (struct seal){.session = wire->proves ? get_u32(payload) : 0};
        memcpy(wire->seal.key, wire->key, sizeof wire->key);
    }
}

static void take_reply(struct connection *wire, uint8_t byte) {
    wire->reply[wire->reply_count++] = byte;
    size_t size = wire->reply_count < 2 ? SIZE_MAX : get_u16(wire->reply);
    CLAIM(wire->reply_count < 2 || (size > 0 && size <= WIRE_PACKET_MAX), "a reply of %zu bytes", size);
    if (wire->reply_count < 2 || wire->reply_count < 2 + size)
        return;
    hear(wire, wire->reply + 2, size);
    wire->reply_count = 0;
}

/* ---- the streams of net_wire.c ---- */

static long wire_read(const struct net_stream *stream, char *bytes, size_t size) {
    struct connection *wire = stream->ctx;
    size_t count = wire->in_count < size ? wire->in_count : size;
    CLAIM(wire->open, "a closed connection is read");
    if (wire->failed)
        return NET_GONE;
    count = count < wire->cut ? count : wire->cut;
    memcpy(bytes, wire->in, count);
    memmove(wire->in, wire->in + count, wire->in_count -= count);
    return count == 0 && wire->ended && wire->in_count == 0 ? NET_ENDED : (long)count;
}

static long wire_write(const struct net_stream *stream, const char *bytes, size_t count) {
    struct connection *wire = stream->ctx;
    CLAIM(wire->open, "a closed connection is written to");
    if (wire->failed)
        return NET_GONE;
    count = count < wire->takes ? count : wire->takes;
    for (size_t n = 0; n < count; n++)
        take_reply(wire, (uint8_t)bytes[n]);
    return (long)count;
}

/* One that knows the key goes when it ends, breaks the rules of frames, or has been silent for long. */
static bool may_be_closed(const struct connection *wire) {
    if (!wire->knows || !scene.locks || wire->ended || wire->failed || wire->bad)
        return true;
    for (unsigned n = 0; n < SESSION_CLIENTS; n++)
        if (scene.net.client[n].stream.ops != NULL && scene.net.client[n].stream.ctx == wire)
            return scene.session.now_us - scene.session.client[n].heard_us >= SILENT_S * 1000000ull;
    return true;
}

static void wire_close_stream(const struct net_stream *stream) {
    struct connection *wire = stream->ctx;
    CLAIM(wire->open, "closed twice");
    CLAIM(may_be_closed(wire), "one that is logged in was closed");
    wire->open = false;
}

bool fuzz_accept(int listener, struct net_stream *stream, char name[NET_ADDRESS_SIZE]) {
    static const struct net_stream_ops ops = {wire_read, wire_write, wire_close_stream};
    (void)listener;
    for (int n = 0; n < WIRES; n++) {
        struct connection *wire = &scene.connection[n];
        if (!wire->waits)
            continue;
        wire->waits = false;
        wire->open = true;
        name[0] = '\0';
        *stream = (struct net_stream){.ops = &ops, .ctx = wire, .fd = n, .peer = peer_of(wire->address)};
        return true;
    }
    return false;
}

bool fuzz_peer(int fd, struct net_address *out) {
    *out = (struct net_address){.port = 40000};
    address_of(scene.connection[fd].address, out->bytes);
    return !scene.connection[fd].failed;
}

void fuzz_keep_alive(const struct net_stream *stream) {
    (void)stream;
}

int fuzz_listen(const char *host, const char *port, char address[NET_ADDRESS_SIZE], int *error) {
    (void)host;
    (void)port;
    address[0] = '\0';
    *error = 0;
    return 1;
}

int fuzz_udp(const struct net_address *here, bool shared, int *error) {
    (void)here;
    (void)shared;
    *error = 0;
    return 2;
}

void fuzz_watch(int fd) {
    (void)fd;
}

void fuzz_close(int fd) {
    (void)fd;
}

bool fuzz_unreachable(int fd, struct net_address *to) {
    (void)fd;
    if (scene.closed == 0)
        return false;
    *to = (struct net_address){.port = WIRE_STATUS_PORT};
    address_of(scene.closed % (ADDRESSES + OTHERS), to->bytes);
    scene.closed = 0;
    return true;
}

long fuzz_receive(int fd, uint8_t *bytes, size_t size, struct net_address *from) {
    struct packet *datagram = &scene.datagram;
    (void)fd;
    if (datagram->size == 0)
        return NET_NOTHING;
    size_t count = datagram->size < size ? datagram->size : size;
    *from = (struct net_address){.port = 40000};
    address_of(scene.datagram_from, from->bytes);
    memcpy(bytes, datagram->bytes, count);
    scene.came[scene.datagram_from] += count;
    datagram->size = 0;
    return (long)count;
}

void fuzz_send(int fd, const struct net_address *to, const uint8_t *bytes, size_t count) {
    struct wire_header header;
    const unsigned n = to->bytes[3];
    (void)fd;
    CLAIM(n < ADDRESSES + OTHERS, "sent to no one");
    CLAIM(wire_open(bytes, count, &header), "what it sends is no packet");
    scene.went[n] += count;
    CLAIM(!scene.locks || scene.connected[n] || scene.went[n] <= scene.came[n],
          "%zu bytes to an address that has sent %zu", scene.went[n], scene.came[n]);
}

static void repeatable(void *ctx, uint8_t *bytes, size_t count) {
    (void)ctx;
    for (size_t n = 0; n < count; n++) {
        scene.random = scene.random * 1664525u + 1013904223u;
        bytes[n] = (uint8_t)(scene.random >> 24);
    }
}

#endif
