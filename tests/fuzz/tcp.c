/* SPDX-License-Identifier: MIT
 * The connections of the binary protocol: net_wire.c with a network of this file, a session and a machine in
 * virtual time. Connections come and go from some addresses, send frames of good and bad messages, cut at any
 * byte and ended in the middle of one, with lengths that cannot be, and read their replies or not. Some know
 * the key, log in, and seal their datagrams. Whatever happens:
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
enum { SILENT_S = WIRE_CLIENT_IDLE_S, LOGIN_MS = 30000, WAIT_MS = (SILENT_S + 20) * 1000 };

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

static void say(struct connection *wire, const uint8_t *bytes, size_t count) {
    if (!wire->open || wire->ended || wire->failed || wire->in_count + count > sizeof wire->in)
        return;
    memcpy(wire->in + wire->in_count, bytes, count);
    wire->in_count += count;
}

static bool has_room(const struct connection *wire, size_t count) {
    return wire->open && !wire->ended && !wire->failed && wire->in_count + count <= sizeof wire->in;
}

/* @param count  of the frame that is sent; less than the whole: what comes next makes it another one */
static void say_frame(struct connection *wire, const uint8_t *message, size_t size) {
    uint8_t frame[2 + WIRE_CONTROL_MAX];
    put_u16(frame, (uint16_t)size);
    memcpy(frame + 2, message, size);
    say(wire, frame, 2 + size);
}

/* A good message, whose payload is in place. */
static void ask(struct connection *wire, uint8_t *message, uint8_t type, size_t payload) {
    const uint32_t number = ++scene.sequence;
    size_t size = wire_close(message, type, payload, number, number);
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

bool fuzz_unreachable(int fd, struct net_address *to) {
    (void)fd;
    if (scene.closed == 0)
        return false;
    *to = (struct net_address){.port = WIRE_STATUS_PORT};
    address_of(scene.closed % (ADDRESSES + OTHERS), to->bytes);
    scene.closed = 0;
    return true;
}

void fuzz_close(int fd) {
    (void)fd;
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
    const uint32_t number = ++scene.sequence;
    packet.size = wire_close(packet.bytes, type, size, number, number);
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
    for (unsigned ms = 0; ms < LOGIN_MS; ms += 50) {
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
