/* SPDX-License-Identifier: MIT
 * What the harnesses of the binary protocol share: hosts that send good and bad packets to a device in
 * virtual time, and what it sends back. */
#ifndef WIFICNC_TESTS_FUZZ_PEERS_H
#define WIFICNC_TESTS_FUZZ_PEERS_H

#include "fuzz.h"

#include "host.h"
#include "host_wire.h"
#include "wire/packet.h"

enum { HZ = 1000000, STEP_RATE_HZ = 20000, HOSTS = 3, HOST_PORT = 4000, SECONDS_MAX = 20, REPLY_MAX = 104 };

/** A board of three axes. */
static const struct host_board peers_board = {.timer_hz = HZ,
                                              .step_pulse_ns = 5000,
                                              .dir_setup_ns = 5000,
                                              .max_step_rate_hz = STEP_RATE_HZ,
                                              .axis_count = 3};

struct peers {
    struct host *host;
    struct host_wire *wire;
    uint32_t sequence;
    void (*heard)(const struct wire_header *header, const uint8_t *payload); /* of what it sends; or NULL */
};

/** Whether there is input left, and time. */
static inline bool peers_go_on(const struct peers *peers, const struct input *input) {
    return input_left(input) > 0 && host_time_ticks(peers->host) < (uint64_t)SECONDS_MAX * HZ;
}

static inline uint32_t peers_address(unsigned number) {
    return 0x0A000002u + number % HOSTS;
}

/** What it sends are packets. */
static inline void peers_take(struct peers *peers) {
    uint8_t packet[WIRE_PACKET_MAX];
    struct wire_header header;
    uint32_t address;
    uint16_t port;
    size_t size;
    while ((size = host_wire_sent(peers->wire, &address, &port, packet, sizeof packet)) > 0) {
        CLAIM(wire_open(packet, size, &header) && size == (size_t)WIRE_HEADER_SIZE + header.length,
              "what it sends is no packet");
        if (peers->heard != NULL)
            peers->heard(&header, packet + WIRE_HEADER_SIZE);
    }
}

static inline void peers_run(struct peers *peers, uint32_t ms) {
    host_wire_run(peers->wire, host_time_ticks(peers->host) + (uint64_t)ms * (HZ / 1000));
    peers_take(peers);
}

/** A packet whose payload is in place. @return its size */
static inline size_t peers_close(struct peers *peers, uint8_t *packet, uint8_t type, size_t payload_size) {
    return wire_close(packet, type, payload_size, ++peers->sequence, 0);
}

/** Type and payload of the input in a good packet, or the bytes as they are. @return its size */
static inline size_t peers_packet(struct peers *peers, struct input *input, uint8_t *packet, bool good) {
    uint8_t type = input_byte(input);
    size_t size = input_byte(input);
    for (size_t i = 0; i < size; i++)
        packet[WIRE_HEADER_SIZE + i] = input_byte(input);
    if (good)
        return peers_close(peers, packet, type, size);
    packet[0] = type;
    return size;
}

static inline void peers_send(struct peers *peers, unsigned host, const uint8_t *packet, size_t size) {
    host_wire_datagram(peers->wire, peers_address(host), HOST_PORT, packet, size);
}

/** A connection of this host, or where there is no place that of another one. */
static inline int peers_connect(struct peers *peers, unsigned host) {
    int client = host_wire_connect(peers->wire, peers_address(host));
    return client < 0 ? 0 : client;
}

/** A request has at most one reply, a good one has it. @param[out] reply  room for WIRE_PACKET_MAX
 *  @return type of the reply, 0: none */
static inline uint8_t peers_ask(struct peers *peers, int client, const uint8_t *packet, size_t size,
                                bool good, uint8_t *reply) {
    struct wire_header header;
    size_t replied = host_wire_request(peers->wire, client, packet, size, reply);
    CLAIM(!good || replied > 0, "a good request has a reply");
    if (replied == 0)
        return 0;
    CLAIM(wire_open(reply, replied, &header) && replied <= REPLY_MAX, "the reply is no packet");
    return header.type;
}

#endif
