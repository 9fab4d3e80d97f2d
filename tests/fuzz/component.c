/* SPDX-License-Identifier: MIT
 * The LinuxCNC component before a controller that says anything, and a LinuxCNC that wants anything. Whatever
 * comes:
 *
 *   - what it sends are packets, by TCP one after the other
 *   - the segments of a stream have each number once, and always the same steps when they are sent again
 *   - they lead from where the controller said that the machine is to where the last command was followed
 * to
 *   - what was lost stays lost until the next connection
 *
 * The input is a row of actions; the first byte says which, what it needs follows. */
#include "fuzz.h"

#include "link.h"
#include "wire/bytes.h"

#include <math.h>
#include <string.h>

enum { ACTIONS = 10, PINS_MAX = 128, TICKS_MAX = 2000, STREAM_MAX = 4096, TICK_SAMPLES = 10 };

union value {
    bool bit;
    double number;
    uint32_t count;
};

struct bench {
    struct link link;
    struct pins pins;
    union value values[PINS_MAX];
    unsigned used;
    double now_s, servo_s;
    double command[PIN_JOINTS];
    bool probes;
    uint8_t asked; /* type of the newest request */
    bool was_lost;
    bool is_trust_asked; /* a question about no stream: whether the position is trusted */
    bool is_open;
    uint32_t stream;           /* that is, or was */
    int32_t begun[PIN_JOINTS]; /* where it began */
    uint32_t segments;         /* known ones of it */
    int32_t steps[STREAM_MAX][PIN_JOINTS];
};

static int make_pin(void *ctx, const char *name, enum pin_type type, enum pin_direction direction,
                    void **at) {
    struct bench *bench = ctx;
    (void)type;
    (void)direction;
    CLAIM(bench->used < PINS_MAX && strlen(name) < PIN_NAME_MAX - 1, "%s", name);
    *at = &bench->values[bench->used++];
    return 0;
}

static void take_segments(struct bench *bench, const uint8_t *payload, size_t size) {
    struct wire_stream_segments head;
    wire_get_stream_segments(payload, &head);
    CLAIM(head.count <= WIRE_MOTION_SEGMENTS_MAX, "%u segments", head.count);
    CLAIM(size == WIRE_STREAM_SEGMENTS_SIZE + head.count * (size_t)WIRE_SEGMENT_SIZE, "%zu bytes", size);
    if (head.count == 0 && head.stream % 2 == 0) {
        bench->is_trust_asked = true;
        return;
    }
    CLAIM(bench->is_open && head.stream == bench->stream, "segments of stream %u", (unsigned)head.stream);
    for (uint32_t n = head.first; n < head.first + head.count && n < STREAM_MAX; n++) {
        struct wire_segment segment;
        wire_get_segment(payload + WIRE_STREAM_SEGMENTS_SIZE + (n - head.first) * WIRE_SEGMENT_SIZE,
                         &segment);
        CLAIM(n <= bench->segments, "segment %u is the first after %u", (unsigned)n,
              (unsigned)bench->segments);
        if (n == bench->segments)
            memcpy(bench->steps[bench->segments++], segment.steps, sizeof segment.steps);
        CLAIM(memcmp(bench->steps[n], segment.steps, sizeof segment.steps) == 0, "segment %u has changed",
              (unsigned)n);
    }
}

static void send_udp(void *ctx, const uint8_t *packet, size_t size) {
    struct wire_header header;
    CLAIM(wire_open(packet, size, &header) && size == (size_t)WIRE_HEADER_SIZE + header.length, "no packet");
    if (header.type == WIRE_STREAM_SEGMENTS)
        take_segments(ctx, packet + WIRE_HEADER_SIZE, header.length);
}

static void send_tcp(void *ctx, const uint8_t *bytes, size_t size) {
    struct bench *bench = ctx;
    struct wire_header header;
    CLAIM(size > CONTROL_SIZE_BYTES && get_u16(bytes) == size - CONTROL_SIZE_BYTES, "no message");
    CLAIM(wire_open(bytes + CONTROL_SIZE_BYTES, size - CONTROL_SIZE_BYTES, &header), "no packet");
    bench->asked = header.type;
}

static void counted(void *ctx, uint8_t *bytes, size_t count) {
    (void)ctx;
    for (size_t i = 0; i < count; i++)
        bytes[i] = (uint8_t)i;
}

static void await_servo(void *ctx) {
    (void)ctx;
}

static void say(void *ctx, const char *text) {
    (void)ctx;
    CLAIM(text[0] != '\0', "it says nothing");
}

static void connect(struct bench *bench) {
    const struct peer_world world = {bench, send_udp, send_tcp, counted, await_servo, say};
    const struct link_options options = {.joints = 3, .level_s = 0.1, .key = ""};
    link_begin(&bench->link, &bench->pins, &world, &options, bench->now_s);
    bench->was_lost = false;
    bench->segments = 0;
}

/* A stream begins where the machine is by the report that is the newest just then. */
static void note_stream(struct bench *bench) {
    const struct link *link = &bench->link;
    bool begins = link->is_open && (!bench->is_open || link->sender.stream != bench->stream);
    bench->is_open = link->is_open;
    if (!begins)
        return;
    bench->stream = link->sender.stream;
    bench->segments = 0;
    memcpy(bench->begun, link->peer.status.position_steps, sizeof bench->begun);
}

static void answer_trust(struct bench *bench) {
    uint8_t packet[WIRE_PACKET_MAX];
    struct wire_stream_ack ack = {.refusal = WIRE_REFUSAL_STREAM_CLOSED};
    bench->is_trust_asked = false;
    wire_put_stream_ack(packet + WIRE_HEADER_SIZE, &ack);
    size_t size =
        wire_close(packet, WIRE_STREAM_ACK, WIRE_STREAM_ACK_SIZE, 1, (uint32_t)(1e6 * bench->now_s));
    peer_hear_udp(&bench->link.peer, packet, size, bench->now_s);
}

static void tick(struct bench *bench) {
    for (unsigned n = 0; n < TICK_SAMPLES; n++) {
        struct sample sample = {.servo_s = bench->servo_s += 0.001,
                                .motion_type = bench->probes ? LINUXCNC_PROBING : LINUXCNC_LINEAR_FEED};
        memcpy(sample.command, bench->command, sizeof sample.command);
        link_sample(&bench->link, &sample, bench->now_s);
    }
    bench->now_s += LINK_TICK_S;
    bool lost = link_tick(&bench->link, bench->now_s) != NULL;
    CLAIM(lost || !bench->was_lost, "lost, and found without a connection");
    if (bench->is_trust_asked)
        answer_trust(bench);
    bench->was_lost = lost;
    const struct link *link = &bench->link;
    if (!link->is_open || link->sender.stream != bench->stream || bench->segments != link->sender.end)
        return;
    for (unsigned joint = 0; joint < bench->pins.joints; joint++) {
        uint32_t at = (uint32_t)bench->begun[joint];
        for (uint32_t n = 0; n < bench->segments; n++)
            at += (uint32_t)bench->steps[n][joint];
        CLAIM((int32_t)at == link->slicer.steps[joint], "joint %u: %d, not %d", joint, (int)at,
              (int)link->slicer.steps[joint]);
    }
}

static size_t fill(struct input *input, uint8_t *bytes, size_t count) {
    size_t size = 0;
    for (; size < count && input_left(input) > 0; size++)
        bytes[size] = input_byte(input);
    return size;
}

/* A good packet of this type. Its payload is the input's, and zeros. */
static size_t packet_of(struct bench *bench, struct input *input, uint8_t *packet, uint8_t type) {
    uint8_t size = input_byte(input);
    uint32_t at_us = (uint32_t)(1e6 * bench->now_s) - input_byte(input);
    memset(packet + WIRE_HEADER_SIZE, 0, size);
    fill(input, packet + WIRE_HEADER_SIZE, size);
    return wire_close(packet, type, size, 1, at_us);
}

static void answer(struct bench *bench, uint8_t *message, size_t size) {
    put_u16(message, (uint16_t)size);
    peer_hear_tcp(&bench->link.peer, message, CONTROL_SIZE_BYTES + size, bench->now_s);
}

/* What a controller would say to the newest request. */
static void answer_well(struct bench *bench) {
    uint8_t message[CONTROL_MESSAGE_MAX] = {0};
    uint8_t *packet = message + CONTROL_SIZE_BYTES, *payload = packet + WIRE_HEADER_SIZE;
    if (bench->asked == WIRE_HANDSHAKE || bench->asked == WIRE_PROBE_LAST) {
        struct wire_handshake_response hello = {.axes = 6, .capabilities = WIRE_CAPABILITY_STREAM};
        wire_put_handshake_response(payload, &hello);
        answer(bench, message,
               wire_close(packet, WIRE_HANDSHAKE_RESPONSE, WIRE_HANDSHAKE_RESPONSE_SIZE, 1, 0));
        memset(payload, 0, WIRE_PROBE_RESULT_SIZE);
        answer(bench, message, wire_close(packet, WIRE_PROBE_RESULT, WIRE_PROBE_RESULT_SIZE, 2, 0));
    } else if (bench->asked == WIRE_STREAM_OPEN) {
        for (unsigned joint = 0; joint < bench->pins.joints; joint++) {
            struct wire_config_value rate = {.key = (uint16_t)(0x10 + joint)};
            put_u32(rate.value, 20000);
            wire_put_config_value(payload, &rate);
            answer(bench, message, wire_close(packet, WIRE_CONFIG_VALUE, WIRE_CONFIG_VALUE_SIZE, 1, 0));
        }
        struct wire_stream_opened opened = {.stream = (bench->stream + 2) | 1, .capacity = 100};
        wire_put_stream_opened(payload, &opened);
        answer(bench, message, wire_close(packet, WIRE_STREAM_OPENED, WIRE_STREAM_OPENED_SIZE, 4, 0));
    } else {
        wire_put_ack(payload, &(struct wire_ack){.type = bench->asked});
        answer(bench, message, wire_close(packet, WIRE_ACK, WIRE_ACK_SIZE, 1, 0));
    }
}

static void set_pin(struct bench *bench, unsigned which, double number) {
    volatile bool *bits[] = {bench->pins.enable,
                             bench->pins.estop,
                             bench->pins.reset,
                             bench->pins.spindle_on,
                             bench->pins.joint[0].index_enable,
                             bench->pins.joint[2].index_enable,
                             &bench->probes};
    enum { BITS = sizeof bits / sizeof *bits };
    if (which % (BITS + 3) < BITS)
        *bits[which % (BITS + 3)] = number > 0.0;
    else
        bench->command[which % 3] = number;
}

static double number_of(struct input *input) {
    static const double numbers[] = {0.0, 1.0, -1.0, 0.5, 1e9, -1e12, NAN, INFINITY, -0.004, 3.33, 100.0};
    return numbers[input_byte(input) % (sizeof numbers / sizeof *numbers)];
}

/* An ack of the stream that is open: all is taken, and what the input says of it is executed. */
static void acknowledge(struct bench *bench, struct input *input) {
    uint8_t packet[WIRE_PACKET_MAX];
    struct wire_stream_ack ack = {
        .stream = bench->link.sender.stream, .next = bench->link.sender.end, .free = 100};
    uint8_t left = input_byte(input), refusal = input_byte(input);
    ack.done = ack.next > left ? ack.next - left : ack.next;
    ack.refusal = refusal > 200 ? refusal - 200 : 0;
    ack.queued_us = left * 10000u;
    wire_put_stream_ack(packet + WIRE_HEADER_SIZE, &ack);
    size_t size =
        wire_close(packet, WIRE_STREAM_ACK, WIRE_STREAM_ACK_SIZE, 1, (uint32_t)(1e6 * bench->now_s));
    peer_hear_udp(&bench->link.peer, packet, size, bench->now_s);
}

static void stand(struct bench *bench) {
    uint8_t packet[WIRE_PACKET_MAX];
    struct wire_status status = bench->link.peer.status;
    status.state = WIRE_STATE_IDLE;
    status.flags = 0;
    wire_put_status(packet + WIRE_HEADER_SIZE, &status);
    size_t size = wire_close(packet, WIRE_STATUS, WIRE_STATUS_SIZE, 1, (uint32_t)(1e6 * bench->now_s));
    peer_hear_udp(&bench->link.peer, packet, size, bench->now_s);
}

static void act(struct bench *bench, struct input *input) {
    uint8_t message[CONTROL_MESSAGE_MAX];
    uint8_t action = input_byte(input) % ACTIONS;
    if (action == 0)
        peer_hear_udp(&bench->link.peer, message, fill(input, message, input_byte(input)), bench->now_s);
    else if (action == 1)
        peer_hear_tcp(&bench->link.peer, message, fill(input, message, input_byte(input)), bench->now_s);
    else if (action == 2)
        peer_hear_udp(&bench->link.peer, message, packet_of(bench, input, message, input_byte(input)),
                      bench->now_s);
    else if (action == 3)
        answer(bench, message, packet_of(bench, input, message + CONTROL_SIZE_BYTES, input_byte(input)));
    else if (action == 4)
        answer_well(bench);
    else if (action == 5)
        set_pin(bench, input_byte(input), number_of(input));
    else if (action == 6)
        acknowledge(bench, input);
    else if (action == 7)
        stand(bench);
    else if (action == 8 && bench->was_lost)
        connect(bench);
    else
        tick(bench);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static struct bench bench;
    struct input input = {data, data + size};
    memset(&bench, 0, sizeof bench);
    bench.pins.joints = 3;
    bench.now_s = 100.0;
    CLAIM(pins_make(&bench.pins, make_pin, &bench) == 0, "pins");
    connect(&bench);
    for (unsigned n = 0; n < TICKS_MAX && input_left(&input) > 0; n++) {
        act(&bench, &input);
        note_stream(&bench);
    }
    return 0;
}
