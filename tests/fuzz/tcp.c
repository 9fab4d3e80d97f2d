/* SPDX-License-Identifier: MIT
 * The connections of the binary protocol: net_wire.c with the network of tcp_network.h, a session and a
 * machine in virtual time. Connections come and go from some addresses, send frames of good and bad messages,
 * cut at any byte and ended in the middle of one, with lengths that cannot be, and read their replies or not.
 * Some know the key, log in, and seal their datagrams. Whatever happens:
 *
 *   - each good message has one reply, in order, in a frame of its own; half a message has none, nor has
 *     what follows a length that cannot be, which ends the connection
 *   - before the key was proven nothing steps, switches, is set, or has an owner
 *   - a connection that has proven the key is closed by no one but its client, unless it is silent for long
 *   - an address that has no connection gets no more bytes than came from it
 *   - and who has the key gets in afterwards
 *
 * The first byte chooses whether there is a password. Then two bytes make one thing that happens: what, and
 * to which connection or how. */
#include "tcp_network.h"

/* ---- time ---- */

static void count_steps(void *ctx, const struct trace_event *events, size_t count) {
    (void)ctx;
    for (size_t n = 0; n < count; n++)
        scene.steps += events[n].step_mask != 0;
}

static void check_strangers_do_nothing(void) {
    const struct machine *machine = &scene.host->machine;
    if (!scene.locks || scene.any_proved)
        return;
    CLAIM(scene.steps == 0, "%u steps without a key", scene.steps);
    CLAIM(!scene.session.owner.on && !scene.session.stream.open, "a stranger is the owner");
    CLAIM(machine_outputs(machine)->spindle == SPINDLE_OFF && machine_outputs(machine)->coolant == 0 &&
              machine_host_digital(machine) == 0,
          "a stranger switches");
    CLAIM(scene.session.settings->status_interval_ms == scene.interval_ms, "a stranger sets");
}

static void pass(uint32_t ms) {
    struct host *host = scene.host;
    const uint64_t until = host_time_ticks(host) + (uint64_t)ms * (HZ / 1000);
    while (host_time_ticks(host) < until)
        (void)host_run_paced(host, until, 1 << 20);
    access_poll(&scene.access, hal_time_us(&host->hal));
    session_poll(&scene.session);
    net_wire_round(&scene.net);
    check_strangers_do_nothing();
}

/* ---- what happens ---- */

/* @return NULL: all are in use */
static struct connection *come(unsigned address) {
    for (struct connection *wire = scene.connection; wire < scene.connection + WIRES; wire++) {
        if (wire->open || wire->waits)
            continue;
        *wire = (struct connection){
            .address = (uint8_t)(address % ADDRESSES), .cut = ALL, .takes = ALL, .waits = true};
        scene.connected[wire->address] = true;
        return wire;
    }
    return NULL;
}

static void ping(struct connection *wire) {
    uint8_t message[WIRE_PACKET_MAX] = {0};
    unsigned asked = wire->asked;
    wire_put_ping(message + WIRE_HEADER_SIZE, &(struct wire_ping){.id = wire->pings + 1});
    ask(wire, message, WIRE_PING, WIRE_PING_SIZE);
    wire->pings += wire->asked - asked;
}

static void challenge(struct connection *wire) {
    uint8_t message[WIRE_PACKET_MAX] = {0};
    ask(wire, message, WIRE_CHALLENGE, 0);
}

/* The right proof of the last nonce, or one with a bit of it wrong. */
static void prove(struct connection *wire, bool right) {
    uint8_t message[WIRE_PACKET_MAX] = {0};
    struct wire_authenticate proof = {.nonce = {1, 2, 3}};
    if (!wire->has_nonce)
        return;
    seal_derive(scene.access.secret, wire->nonce, proof.nonce, proof.proof, wire->key);
    proof.proof[scene.sequence % SHA256_SIZE] ^= (uint8_t)(right ? 0 : 1u << (scene.sequence / 32 % 8));
    wire->proves |= right;
    scene.any_proved |= right;
    wire_put_authenticate(message + WIRE_HEADER_SIZE, &proof);
    ask(wire, message, WIRE_AUTHENTICATE, WIRE_AUTHENTICATE_SIZE);
}

/* Types with payloads of the input, which are mostly too short or refused; ping has its numbers. */
static void ask_anything(struct connection *wire, uint8_t type, struct input *input) {
    uint8_t message[WIRE_PACKET_MAX] = {0};
    size_t count = input_byte(input) % 64;
    if (type == WIRE_PING || type == WIRE_AUTHENTICATE)
        return;
    for (size_t n = 0; n < count; n++)
        message[WIRE_HEADER_SIZE + n] = input_byte(input);
    ask(wire, message, type, count);
}

/* What moves, switches, and takes. */
static size_t command(uint8_t how, uint8_t *payload, uint8_t *type) {
    static const uint8_t types[] = {WIRE_JOG,   WIRE_IO_CONTROL,  WIRE_TAKE,   WIRE_STREAM_OPEN, WIRE_HOME,
                                    WIRE_RESET, WIRE_STREAM_DROP, WIRE_RESUME, WIRE_CONFIG_SET,  WIRE_HOLD};
    *type = types[how % (sizeof types)];
    switch (*type) {
    case WIRE_JOG:
        wire_put_jog(payload, &(struct wire_jog){.axis = how / 16 % 3, .direction = 1, .speed_steps_s = 500});
        return WIRE_JOG_SIZE;
    case WIRE_IO_CONTROL:
        wire_put_io_control(payload,
                            &(struct wire_io_control){.misc_outputs = how, .spindle = 1, .rpm = 999});
        return WIRE_IO_CONTROL_SIZE;
    case WIRE_CONFIG_SET:
        wire_put_config_set(
            payload, &(struct wire_config_set){.key = 0x0103, .value_type = 1, .value = {20 + how % 64}});
        return WIRE_CONFIG_SET_SIZE;
    default:
        payload[0] = 1;
        return 4;
    }
}

static void ask_command(struct connection *wire, uint8_t how) {
    uint8_t message[WIRE_PACKET_MAX] = {0}, type;
    size_t size = command(how, message + WIRE_HEADER_SIZE, &type);
    ask(wire, message, type, size);
}

/* From this connection's address or another one; sealed where there is a session, or one that was heard. */
static void send_datagram(struct connection *wire, uint8_t how) {
    struct packet packet = {.size = 0};
    uint8_t type;
    size_t size = command(how / 2, packet.bytes + WIRE_HEADER_SIZE, &type);
    packet.size = wire_close(packet.bytes, type, size, ++scene.sequence, 1);
    scene.datagram_from = (uint8_t)(how % 3 == 0 ? how % (ADDRESSES + OTHERS) : wire->address);
    if (wire->knows && how % 5 != 0)
        packet.size = seal_close(&wire->seal, packet.bytes, packet.size);
    scene.overheard[scene.overheard_count++ % OVERHEARD] = packet;
    scene.datagram = packet;
}

static void play_again(uint8_t how) {
    const struct packet *packet = &scene.overheard[how % OVERHEARD];
    scene.datagram = *packet;
    scene.datagram_from = how / OVERHEARD % (ADDRESSES + OTHERS);
}

/* A frame that is no message, with this length: bytes of the input. */
static void say_junk(struct connection *wire, struct input *input) {
    uint8_t junk[WIRE_CONTROL_MAX];
    size_t size = 1u + input_byte(input) % 40u;
    if (wire->bad || !has_room(wire, 2 + size))
        return;
    for (size_t n = 0; n < size; n++)
        junk[n] = input_byte(input);
    junk[0] = 0; /* not the magic */
    say_frame(wire, junk, size);
}

/* A length that cannot be, and a command and a ping that no one may execute. */
static void say_bad_length(struct connection *wire, uint8_t how) {
    const uint16_t lengths[] = {0, WIRE_CONTROL_MAX + 1, 0xFFFF, 0x4D33};
    uint8_t frame[2 + WIRE_PACKET_MAX] = {0};
    put_u16(frame, lengths[how % 4]);
    wire_put_ping(frame + 2 + WIRE_HEADER_SIZE, &(struct wire_ping){.id = 0xBAD});
    size_t size = wire_close(frame + 2, WIRE_PING, WIRE_PING_SIZE, 1, 1);
    if (wire->bad || !has_room(wire, 2 + size))
        return;
    say(wire, frame, 2 + size);
    wire->bad = true;
}

/* A whole message without its last bytes, and the end. */
static void end_in_a_frame(struct connection *wire, uint8_t how) {
    uint8_t frame[2 + WIRE_PACKET_MAX] = {0};
    wire_put_ping(frame + 2 + WIRE_HEADER_SIZE, &(struct wire_ping){.id = 0xBAD});
    size_t size = 2 + wire_close(frame + 2, WIRE_PING, WIRE_PING_SIZE, 1, 1);
    put_u16(frame, (uint16_t)(size - 2));
    say(wire, frame, how % size);
    wire->ended = wire->open;
}

static void happen(uint8_t what, uint8_t how, struct input *input) {
    struct connection *wire = &scene.connection[what / 16 % WIRES];
    switch (what % 16) {
    case 0:
        (void)come(how);
        break;
    case 1:
        challenge(wire);
        break;
    case 2:
        prove(wire, how % 4 != 0 && wire->address < 2); /* the others do not have the key */
        break;
    case 3:
        wire->cut = how == 255 ? (unsigned)ALL : how % 64u;
        break;
    case 4:
        wire->takes = how == 255 ? (unsigned)ALL : how % 64u;
        break;
    case 5:
        ask_anything(wire, how, input);
        break;
    case 6:
        say_junk(wire, input);
        break;
    case 7:
        say_bad_length(wire, how);
        break;
    case 8:
        end_in_a_frame(wire, how);
        break;
    case 9:
        wire->failed = wire->open && how < 200;
        scene.closed = how;
        break;
    case 10:
        play_again(how);
        break;
    case 11:
    case 12:
        send_datagram(wire, how);
        break;
    case 13:
        ask_command(wire, how);
        break;
    case 14:
        ping(wire);
        break;
    default:
        pass(how);
    }
}

/* ---- afterwards ---- */

/* Who is still there reads all, and has a reply to each message. */
static void check_replies(void) {
    for (struct connection *wire = scene.connection; wire < scene.connection + WIRES; wire++)
        wire->cut = wire->takes = ALL;
    /* Several wrong keys on one connection are answered one after the other, each as late as the lockout
     * says. */
    for (unsigned ms = 0; ms < GUESSES_MAX * LOGIN_MS; ms += 50) {
        bool all = true;
        for (const struct connection *wire = scene.connection; wire < scene.connection + WIRES; wire++)
            all &= !wire->open || (wire->in_count == 0 && wire->replied == wire->asked && !wire->bad);
        if (all)
            return;
        pass(50);
    }
    for (const struct connection *wire = scene.connection; wire < scene.connection + WIRES; wire++) {
        CLAIM(!wire->open || !wire->bad, "a length that cannot be did not end a connection");
        CLAIM(!wire->open || wire->in_count > 0 || wire->replied == wire->asked, "%u replies to %u messages",
              wire->replied, wire->asked);
    }
}

/* It shuts itself out, if any one. */
static bool owner_has_all_places(void) {
    const struct session *session = &scene.session;
    bool all = session->owner.on;
    for (unsigned n = 0; n < SESSION_CLIENTS; n++)
        all &= memcmp(session->client[n].address, session->owner.address, 4) == 0;
    return all;
}

/* From an address that has no connection, with the key. */
static void check_the_key_gets_in(void) {
    struct connection *wire = NULL;
    for (struct connection *other = scene.connection; other < scene.connection + WIRES; other++)
        other->ended |= other->open && other->address == 0;
    pass(1);
    for (unsigned ms = 0; ms < WAIT_MS && (wire == NULL || !wire->open); ms += 500) {
        if (wire == NULL || !wire->waits)
            wire = come(0);
        CLAIM(wire != NULL, "the connections of the test are all in use");
        pass(500);
    }
    if (owner_has_all_places())
        return;
    CLAIM(wire != NULL && wire->open, "who has the key was not let in");
    challenge(wire);
    pass(1);
    prove(wire, true);
    for (unsigned ms = 0; ms < LOGIN_MS && !wire->knows; ms += 100)
        pass(100);
    CLAIM(wire->knows, "the right key was not accepted");
}

/* Its secret takes some ms: once for each kind. */
static struct access fresh_access(bool locks) {
    static const uint8_t salt[ACCESS_SALT];
    static struct access made[2];
    static bool is_made[2];
    if (!is_made[locks])
        access_init(&made[locks], the_key, !locks, salt, 0);
    is_made[locks] = true;
    return made[locks];
}

static void begin(bool locks) {
    static const struct session_ops ops = {.send = net_wire_send, .random = repeatable};
    static const struct host_board board = {.timer_hz = HZ,
                                            .step_pulse_ns = 5000,
                                            .dir_setup_ns = 5000,
                                            .max_step_rate_hz = 20000,
                                            .axis_count = 3};
    memset(&scene, 0, sizeof scene);
    scene.locks = locks;
    scene.access = fresh_access(locks);
    scene.host = host_create(&board);
    if (scene.host == NULL)
        abort();
    scene.access.clock_us = hal_time_us(&scene.host->hal);
    (void)trace_add(host_trace(scene.host), count_steps, NULL);
    const struct session_options options = {
        .name = "fuzz", .access = &scene.access, .status_port = WIRE_STATUS_PORT};
    session_init(&scene.session, &scene.host->machine, &options, &ops, &scene.net);
    scene.interval_ms = scene.session.settings->status_interval_ms;
    CLAIM(net_wire_open(&scene.net, "0.0.0.0", &scene.session) == 0, "the ports are closed");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct input input = {data, data + size};
    begin((input_byte(&input) & 1) == 0);
    const uint64_t end = host_time_ticks(scene.host) + (uint64_t)MS_MAX * (HZ / 1000);
    for (unsigned n = 0; n < THINGS_MAX && input_left(&input) > 0 && host_time_ticks(scene.host) < end; n++) {
        uint8_t what = input_byte(&input);
        happen(what, input_byte(&input), &input);
        pass(1);
    }
    check_replies();
    check_the_key_gets_in();
    for (struct connection *wire = scene.connection; wire < scene.connection + WIRES; wire++)
        wire->ended = true; /* now anyone may be closed */
    net_wire_close(&scene.net);
    host_destroy(scene.host);
    return 0;
}
