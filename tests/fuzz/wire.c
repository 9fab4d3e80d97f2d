/* SPDX-License-Identifier: MIT
 * A device of the binary protocol with a machine behind it, in virtual time. Whatever arrives:
 *
 *   - what it sends are packets, and every request of ours has at most one reply
 *   - the position counter is the pulses that left the pins (homing alone sets it again)
 *   - no two pulses of an axis are closer than the board's step rate allows
 *   - what was taken is executed to the step when no one stops it; after e-stop and reset a segment moves
 * again
 *
 * The input is a row of actions; the first byte says which, what it needs follows. */
#include "peers.h"

#include "virtual.h"
#include "wire/bytes.h"

enum { ACTIONS = 9, TYPE_AT = 5 /* in a packet */ };

struct target {
    struct peers peers;
    int32_t pulses[AXIS_COUNT];
    uint64_t last_ticks[AXIS_COUNT];
    bool homed;      /* the counter may be set again */
    uint32_t stream; /* of the last stream_opened */
};

static void count_pulses(void *ctx, const struct trace_event *events, size_t count) {
    struct target *device = ctx;
    for (size_t n = 0; n < count; n++) {
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
            if ((events[n].step_mask >> ax & 1) == 0)
                continue;
            uint64_t gap = events[n].t_ticks - device->last_ticks[ax];
            CLAIM(device->last_ticks[ax] == 0 || gap >= HZ / STEP_RATE_HZ / 2, "pulses too close: %u",
                  (unsigned)gap);
            device->last_ticks[ax] = events[n].t_ticks;
            device->pulses[ax] += (events[n].dir_mask >> ax & 1) != 0 ? -1 : 1;
        }
    }
}

static size_t packet_of(struct target *device, struct input *input, uint8_t *packet, bool good) {
    size_t size = peers_packet(&device->peers, input, packet, good);
    device->homed |= good && packet[TYPE_AT] == WIRE_HOME;
    return size;
}

static void send_datagram(struct target *device, struct input *input, bool good) {
    uint8_t packet[WIRE_PACKET_MAX] = {0};
    unsigned host = input_byte(input);
    size_t size = packet_of(device, input, packet, good);
    peers_send(&device->peers, host, packet, size);
}

static void send_request(struct target *device, struct input *input, bool good) {
    uint8_t packet[WIRE_PACKET_MAX] = {0}, reply[WIRE_PACKET_MAX];
    int client = peers_connect(&device->peers, input_byte(input));
    size_t size = packet_of(device, input, packet, good);
    uint8_t type = peers_ask(&device->peers, client, packet, size, good, reply);
    if (type == WIRE_STREAM_OPENED && get_u32(reply + WIRE_HEADER_SIZE) != 0)
        device->stream = get_u32(reply + WIRE_HEADER_SIZE);
    if (input_byte(input) < 128)
        host_wire_disconnect(device->peers.wire, client);
}

/* Segments that are not far from what a machine can do. */
static size_t put_segments(struct input *input, uint8_t *at, unsigned count) {
    for (unsigned k = 0; k < count; k++) {
        struct wire_segment segment = {.id = (uint16_t)k};
        for (unsigned ax = 0; ax < 3; ax++)
            segment.steps[ax] = (int8_t)input_byte(input);
        segment.duration_us = (uint32_t)input_byte(input) << 8 | input_byte(input);
        segment.flags = input_byte(input);
        wire_put_segment(at + (size_t)k * WIRE_SEGMENT_SIZE, &segment);
    }
    return (size_t)count * WIRE_SEGMENT_SIZE;
}

static void send_segments(struct target *device, struct input *input, bool stream) {
    uint8_t packet[WIRE_PACKET_MAX] = {0}, *payload = packet + WIRE_HEADER_SIZE;
    unsigned host = input_byte(input);
    uint8_t count = input_byte(input) % 9;
    size_t head = stream ? WIRE_STREAM_SEGMENTS_SIZE : WIRE_MOTION_SIZE;
    if (stream)
        wire_put_stream_segments(payload, &(struct wire_stream_segments){.stream = device->stream,
                                                                         .first = input_byte(input),
                                                                         .count = count});
    else
        wire_put_motion(payload, &(struct wire_motion){.count = count});
    size_t size = head + put_segments(input, payload + head, count);
    size = peers_close(&device->peers, packet, stream ? WIRE_STREAM_SEGMENTS : WIRE_MOTION, size);
    peers_send(&device->peers, host, packet, size);
}

static void say(struct target *device, struct input *input) {
    char byte = (char)input_byte(input);
    if (byte == 'H')
        device->homed = true; /* of $H */
    (void)host_write(device->peers.host, &byte, 1);
}

static void act(struct target *device, struct input *input) {
    switch (input_byte(input) % ACTIONS) {
    case 0:
        send_datagram(device, input, false);
        break;
    case 1:
        send_datagram(device, input, true);
        break;
    case 2:
        send_segments(device, input, false);
        break;
    case 3:
        send_segments(device, input, true);
        break;
    case 4:
        send_request(device, input, false);
        break;
    case 5:
        send_request(device, input, true);
        break;
    case 6:
        peers_run(&device->peers, input_byte(input));
        break;
    case 7:
        say(device, input);
        break;
    default:
        virtual_set(device->peers.host, input_byte(input) % VIRTUAL_INPUT_COUNT, input_byte(input) < 128);
        break;
    }
    peers_take(&device->peers);
}

static void check_position(const struct target *device) {
    int32_t position[AXIS_COUNT], shift[AXIS_COUNT];
    host_position_steps(device->peers.host, position);
    host_shift_steps(device->peers.host, shift);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        CLAIM(device->homed || position[ax] - shift[ax] == device->pulses[ax], "axis %u: %d of %d", ax,
              (int)position[ax], (int)device->pulses[ax]);
}

static void send_plain(struct target *device, uint8_t type) {
    uint8_t packet[WIRE_PACKET_MAX] = {0};
    size_t size = peers_close(&device->peers, packet, type, 0);
    peers_send(&device->peers, 0, packet, size);
}

/* After all of that: e-stop, a reset, and ten steps. */
static void check_it_still_works(struct target *device) {
    uint8_t packet[WIRE_PACKET_MAX] = {0}, *payload = packet + WIRE_HEADER_SIZE;
    struct wire_segment segment = {.steps = {10}, .duration_us = 100000};
    for (int input = 0; input < VIRTUAL_INPUT_COUNT; input++)
        virtual_set(device->peers.host, input, false);
    /* A host with a connection that has taken control keeps it. */
    for (int client = 0; client < WIRE_CLIENTS_MAX; client++)
        host_wire_disconnect(device->peers.wire, client);
    (void)host_write(device->peers.host, "\x18", 1); /* out of sleep and homing */
    peers_run(&device->peers, 700);
    (void)host_write(device->peers.host, "\n$77=100\n", 9); /* whoever commanded is silent for long enough */
    peers_run(&device->peers, 200);
    send_plain(device, WIRE_ESTOP);
    peers_run(&device->peers, 700);
    send_plain(device, WIRE_RESET);
    peers_run(&device->peers, 300);
    /* $74: the steps of a host that says nothing after them are finished */
    static const char settings[] = "\n$X\n$20=0\n$74=0\n$110=500\n$100=250\n$120=10\n";
    (void)host_write(device->peers.host, settings, sizeof settings - 1);
    peers_run(&device->peers, 200);
    check_position(device);
    int32_t before = device->pulses[0];
    wire_put_motion(payload, &(struct wire_motion){.count = 1});
    wire_put_segment(payload + WIRE_MOTION_SIZE, &segment);
    size_t size = peers_close(&device->peers, packet, WIRE_MOTION, WIRE_MOTION_SIZE + WIRE_SEGMENT_SIZE);
    peers_send(&device->peers, 0, packet, size);
    peers_run(&device->peers, 1500);
    CLAIM(device->pulses[0] - before == 10, "%d steps of 10, state %s", (int)(device->pulses[0] - before),
          host_state(device->peers.host));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct input input = {data, data + size};
    struct host *host = host_create(&peers_board);
    struct target device = {.peers = {.host = host, .wire = host_wire_create(host, "")}};
    (void)trace_add(host_trace(host), count_pulses, &device);
    while (peers_go_on(&device.peers, &input))
        act(&device, &input);
    peers_run(&device.peers, 10);
    check_position(&device);
    check_it_still_works(&device);
    host_wire_destroy(device.peers.wire);
    host_destroy(host);
    return 0;
}
