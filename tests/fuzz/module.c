/* SPDX-License-Identifier: MIT
 * An I/O module, in virtual time. Whatever arrives:
 *
 *   - what it sends are packets, and every request of ours has at most one reply
 *   - only pins that can be outputs are ever driven, and no channel is input and output at the same time
 *   - nothing moves
 *   - after a reset and a sound configuration an output does what it is set to
 *
 * The input is a row of actions; the first byte says which, what it needs follows. */
#include "peers.h"

#include "host_module.h"
#include "wire/bytes.h"

enum { ACTIONS = 9 };

struct target {
    struct peers peers;
    bool connected[SESSION_CLIENTS];
};

static void check_status(const struct wire_header *header, const uint8_t *payload) {
    struct wire_status status;
    if (header->type != WIRE_STATUS)
        return;
    wire_get_status(payload, &status);
    CLAIM((status.io_inputs & status.io_outputs) == 0, "0x%04X in and 0x%04X out", status.io_inputs,
          status.io_outputs);
    CLAIM(status.state == WIRE_STATE_IDLE || status.state == WIRE_STATE_ESTOP, "state %u", status.state);
}

static void check_pins(const struct target *device) {
    uint64_t driven, level = host_wire_levels(device->peers.wire, &driven);
    CLAIM(driven >> MODULE_INPUT_PINS == 0, "an input's pin is driven: 0x%llx", (unsigned long long)driven);
    CLAIM((level & ~driven) == 0, "levels of what is not driven: 0x%llx", (unsigned long long)level);
}

/* ---- packets ---- */

static int client_of(struct target *device, unsigned host) {
    int client = peers_connect(&device->peers, host);
    device->connected[client] = true;
    return client;
}

static void leave(struct target *device, int client) {
    if (device->connected[client])
        host_wire_disconnect(device->peers.wire, client);
    device->connected[client] = false;
}

/* @return type of the reply */
static uint8_t ask(struct target *device, int client, uint8_t *packet, uint8_t type, size_t payload_size) {
    uint8_t reply[WIRE_PACKET_MAX];
    size_t size = peers_close(&device->peers, packet, type, payload_size);
    return peers_ask(&device->peers, client, packet, size, true, reply);
}

static void send_datagram(struct target *device, struct input *input, bool good) {
    uint8_t packet[WIRE_PACKET_MAX] = {0};
    unsigned host = input_byte(input);
    size_t size = peers_packet(&device->peers, input, packet, good);
    peers_send(&device->peers, host, packet, size);
}

static void send_request(struct target *device, struct input *input, bool good) {
    uint8_t packet[WIRE_PACKET_MAX] = {0}, reply[WIRE_PACKET_MAX];
    int client = client_of(device, input_byte(input));
    size_t size = peers_packet(&device->peers, input, packet, good);
    (void)peers_ask(&device->peers, client, packet, size, good, reply);
    if (input_byte(input) < 128)
        leave(device, client);
}

static uint8_t set(struct target *device, int client, uint16_t key, uint16_t value) {
    uint8_t packet[WIRE_PACKET_MAX] = {0};
    struct wire_config_set config = {.key = key, .value_type = WIRE_VALUE_TYPE_U16};
    put_u16(config.value, value);
    wire_put_config_set(packet + WIRE_HEADER_SIZE, &config);
    return ask(device, client, packet, WIRE_CONFIG_SET, WIRE_CONFIG_SET_SIZE);
}

static uint8_t plain(struct target *device, int client, uint8_t type) {
    uint8_t packet[WIRE_PACKET_MAX] = {0};
    return ask(device, client, packet, type, 0);
}

static uint8_t switch_outputs(struct target *device, int client, uint16_t channels, uint16_t on) {
    uint8_t packet[WIRE_PACKET_MAX] = {0};
    wire_put_channel_outputs(packet + WIRE_HEADER_SIZE,
                             &(struct wire_channel_outputs){.channels = channels, .on = on});
    return ask(device, client, packet, WIRE_CHANNEL_OUTPUTS, WIRE_CHANNEL_OUTPUTS_SIZE);
}

/* ---- actions ---- */

static uint16_t input_word(struct input *input) {
    unsigned high = input_byte(input);
    return (uint16_t)(high << 8 | input_byte(input));
}

static void act_at_the_channels(struct target *device, struct input *input, unsigned what) {
    int client = client_of(device, input_byte(input));
    uint16_t one = input_word(input), other = input_word(input);
    if (what == 4)
        (void)set(device, client, (uint16_t)(0x0600 + one % 0x30), other);
    else if (what == 5)
        (void)switch_outputs(device, client, one, other);
    else
        (void)plain(device, client,
                    (one & 1) != 0   ? WIRE_CONFIG_SAVE
                    : (one & 2) != 0 ? WIRE_ESTOP
                                     : WIRE_RESET);
    if (other < 128)
        leave(device, client);
}

static void act(struct target *device, struct input *input) {
    unsigned what = input_byte(input) % ACTIONS;
    switch (what) {
    case 0:
    case 1:
        send_datagram(device, input, what == 1);
        break;
    case 2:
    case 3:
        send_request(device, input, what == 3);
        break;
    case 4:
    case 5:
    case 6:
        act_at_the_channels(device, input, what);
        break;
    case 7:
        peers_run(&device->peers, input_byte(input));
        break;
    default:
        (void)host_wire_hold(device->peers.wire, input_byte(input), input_byte(input) % 3);
        break;
    }
    peers_take(&device->peers);
    check_pins(device);
}

/* ---- at the end ---- */

/* Whoever commands is gone after 100 ms. */
static void release(struct target *device) {
    for (int client = 0; client < SESSION_CLIENTS; client++)
        leave(device, client);
    for (unsigned host = 0; host < HOSTS; host++) {
        int client = client_of(device, host);
        (void)set(device, client, 0x0616, 100);
        leave(device, client);
    }
    peers_run(&device->peers, 200);
}

static void check_it_still_works(struct target *device) {
    static const struct {
        uint16_t key, value;
    } config[] = {{0x0610, 16}, {0x0611, 0xFF00}, {0x0613, 0x0100}, {0x0617, 0}};
    uint64_t driven;
    release(device);
    int client = client_of(device, 0);
    for (size_t i = 0; i < sizeof config / sizeof config[0]; i++)
        CLAIM(set(device, client, config[i].key, config[i].value) == WIRE_ACK, "key 0x%04X", config[i].key);
    for (uint16_t n = 0; n < CHANNELS_MAX; n++)
        CLAIM(set(device, client, (uint16_t)(0x0620 + n), n) == WIRE_ACK, "pin %u", n);
    CLAIM(plain(device, client, WIRE_CONFIG_SAVE) == WIRE_ACK, "a sound configuration");
    CLAIM(plain(device, client, WIRE_RESET) == WIRE_ACK, "a reset");
    CLAIM(switch_outputs(device, client, 0xFF00, 0x0300) == WIRE_ACK, "outputs");
    uint64_t level = host_wire_levels(device->peers.wire, &driven);
    CLAIM(driven == 0xFF00 && level == 0x0200, "0x%llx, levels 0x%llx", (unsigned long long)driven,
          (unsigned long long)level);
}

static void count_steps(void *ctx, const struct trace_event *events, size_t count) {
    (void)ctx;
    for (size_t n = 0; n < count; n++)
        CLAIM(events[n].step_mask == 0, "a step of 0x%02X", events[n].step_mask);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct input input = {data, data + size};
    struct host *host = host_create(&peers_board);
    struct target device = {
        .peers = {.host = host, .wire = host_wire_create_module(host, ""), .heard = check_status}};
    (void)trace_add(host_trace(host), count_steps, NULL);
    while (peers_go_on(&device.peers, &input))
        act(&device, &input);
    peers_run(&device.peers, 10);
    check_it_still_works(&device);
    host_wire_destroy(device.peers.wire);
    host_destroy(host);
    return 0;
}
