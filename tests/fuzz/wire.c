/* SPDX-License-Identifier: MIT
 * A device of the binary protocol with a machine behind it, in virtual time. Whatever arrives:
 *
 *   - what it sends are packets, and every request of ours has at most one reply
 *   - the position counter is the pulses that left the pins (homing alone sets it anew)
 *   - no two pulses of an axis are closer than the board's step rate allows
 *   - what was taken is executed to the step when nobody stops it; after e-stop and reset a segment moves
 * again
 *
 * The input is a row of actions; the first byte says which, what it needs follows. */
#include "fuzz.h"

#include "host.h"
#include "host_wire.h"
#include "virtual.h"
#include "wire/bytes.h"
#include "wire/packet.h"

#include <string.h>

enum { HZ = 1000000, STEP_RATE_HZ = 20000, HOSTS = 3, ACTIONS = 9, SECONDS_MOST = 20 };

struct device {
    struct host *host;
    struct host_wire *wire;
    int32_t pulses[AXIS_COUNT];
    uint64_t last_ticks[AXIS_COUNT];
    bool homed;      /* the counter may be set anew */
    uint32_t stream; /* of the last stream_opened */
    uint32_t sequence;
};

static void count_pulses(void *ctx, const struct trace_event *events, size_t count) {
    struct device *device = ctx;
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

static uint32_t address_of(unsigned number) {
    return 0x0A000002u + number % HOSTS;
}

static void take_sent(struct device *device) {
    uint8_t packet[WIRE_PACKET_MOST];
    struct wire_header header;
    uint32_t address;
    uint16_t port;
    size_t size;
    while ((size = host_wire_sent(device->wire, &address, &port, packet, sizeof packet)) > 0)
        CLAIM(wire_open(packet, size, &header) && size == (size_t)WIRE_HEADER_SIZE + header.length,
              "what it sends is no packet");
}

static void run(struct device *device, uint32_t ms) {
    host_wire_run(device->wire, host_time_ticks(device->host) + (uint64_t)ms * (HZ / 1000));
    take_sent(device);
}

/* A payload of the input in a good packet; or the bytes as they are. @return its size */
static size_t packet_of(struct device *device, struct input *input, uint8_t *packet, bool good) {
    uint8_t type = input_byte(input);
    size_t size = input_byte(input);
    for (size_t i = 0; i < size; i++)
        packet[WIRE_HEADER_SIZE + i] = input_byte(input);
    if (type == WIRE_HOME)
        device->homed = true;
    if (good)
        return wire_close(packet, type, size, ++device->sequence, 0);
    packet[0] = type;
    return size;
}

static void send_datagram(struct device *device, struct input *input, bool good) {
    uint8_t packet[WIRE_PACKET_MOST] = {0};
    unsigned host = input_byte(input);
    size_t size = packet_of(device, input, packet, good);
    host_wire_datagram(device->wire, address_of(host), 4000, packet, size);
}

static void send_request(struct device *device, struct input *input, bool good) {
    uint8_t packet[WIRE_PACKET_MOST] = {0}, reply[WIRE_PACKET_MOST];
    struct wire_header header;
    int client = host_wire_connect(device->wire, address_of(input_byte(input)));
    size_t size = packet_of(device, input, packet, good);
    if (client < 0)
        client = 0;
    size_t replied = host_wire_request(device->wire, client, packet, size, reply);
    if (good)
        CLAIM(replied > 0, "a good request has a reply");
    if (replied > 0)
        CLAIM(wire_open(reply, replied, &header) && replied <= 104, "the reply is no packet");
    if (replied > 0 && header.type == WIRE_STREAM_OPENED && get_u32(reply + WIRE_HEADER_SIZE) != 0)
        device->stream = get_u32(reply + WIRE_HEADER_SIZE);
    if (input_byte(input) < 128)
        host_wire_disconnect(device->wire, client);
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

static void send_segments(struct device *device, struct input *input, bool stream) {
    uint8_t packet[WIRE_PACKET_MOST] = {0}, *payload = packet + WIRE_HEADER_SIZE;
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
    size = wire_close(packet, stream ? WIRE_STREAM_SEGMENTS : WIRE_MOTION, size, ++device->sequence, 0);
    host_wire_datagram(device->wire, address_of(host), 4000, packet, size);
}

static void say(struct device *device, struct input *input) {
    char byte = (char)input_byte(input);
    if (byte == 'H')
        device->homed = true; /* of $H */
    (void)host_write(device->host, &byte, 1);
}

static void act(struct device *device, struct input *input) {
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
        run(device, input_byte(input));
        break;
    case 7:
        say(device, input);
        break;
    default:
        virtual_set(device->host, input_byte(input) % VIRTUAL_INPUT_COUNT, input_byte(input) < 128);
        break;
    }
    take_sent(device);
}

static void check_position(const struct device *device) {
    int32_t position[AXIS_COUNT], shift[AXIS_COUNT];
    host_position_steps(device->host, position);
    host_shift_steps(device->host, shift);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        CLAIM(device->homed || position[ax] - shift[ax] == device->pulses[ax], "axis %u: %d of %d", ax,
              (int)position[ax], (int)device->pulses[ax]);
}

static void send_plain(struct device *device, uint8_t type) {
    uint8_t packet[WIRE_PACKET_MOST] = {0};
    size_t size = wire_close(packet, type, 0, ++device->sequence, 0);
    host_wire_datagram(device->wire, address_of(0), 4000, packet, size);
}

/* After all of that: e-stop, a reset, and ten steps. */
static void check_it_still_works(struct device *device) {
    uint8_t packet[WIRE_PACKET_MOST] = {0}, *payload = packet + WIRE_HEADER_SIZE;
    struct wire_segment segment = {.steps = {10}, .duration_us = 100000};
    for (int input = 0; input < VIRTUAL_INPUT_COUNT; input++)
        virtual_set(device->host, input, false);
    (void)host_write(device->host, "\x18", 1); /* out of sleep and homing */
    run(device, 700);
    (void)host_write(device->host, "\n$77=100\n", 9); /* whoever commanded is silent for long enough */
    run(device, 200);
    send_plain(device, WIRE_ESTOP);
    run(device, 700);
    send_plain(device, WIRE_RESET);
    run(device, 300);
    (void)host_write(device->host, "\n$X\n$20=0\n$110=500\n$100=250\n$120=10\n", 37);
    run(device, 200);
    check_position(device);
    int32_t before = device->pulses[0];
    wire_put_motion(payload, &(struct wire_motion){.count = 1});
    wire_put_segment(payload + WIRE_MOTION_SIZE, &segment);
    size_t size =
        wire_close(packet, WIRE_MOTION, WIRE_MOTION_SIZE + WIRE_SEGMENT_SIZE, ++device->sequence, 0);
    host_wire_datagram(device->wire, address_of(0), 4000, packet, size);
    run(device, 1500);
    CLAIM(device->pulses[0] - before == 10, "%d steps of 10, state %s", (int)(device->pulses[0] - before),
          host_state(device->host));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const struct host_board board = {.timer_hz = HZ,
                                     .step_pulse_ns = 5000,
                                     .dir_setup_ns = 5000,
                                     .max_step_rate_hz = STEP_RATE_HZ,
                                     .axis_count = 3};
    struct input input = {data, data + size};
    struct device device = {.host = host_create(&board)};
    device.wire = host_wire_create(device.host, "");
    (void)trace_add(host_trace(device.host), count_pulses, &device);
    while (input_left(&input) > 0 && host_time_ticks(device.host) < (uint64_t)SECONDS_MOST * HZ)
        act(&device, &input);
    run(&device, 10);
    check_position(&device);
    check_it_still_works(&device);
    host_wire_destroy(device.wire);
    host_destroy(device.host);
    return 0;
}
