/* SPDX-License-Identifier: MIT */
#include "peer.h"

#include "access/key.h"
#include "base/version.h"
#include "words_gen.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const double PING_S = 5.0;
static const double NETWORK_S = 0.05;         /* a report may be so much longer on its way */
static const double INTERVAL_PART = 1.0 / 16; /* of the average is the newest */
static const double REGISTER_S = 0.1;         /* again, until there is a report */
static const double ESTOP_WAY_S = 0.05; /* an e-stop by UDP may be so much longer on its way than a reset */
static const double RESET_MAX_S = 0.5;  /* a reset waits this long for the end of an e-stop */
static const double SILENT_S = 1.0;     /* without a report or an answer for this long it is gone */
enum {
    ALL_AXES = 0xFF,
    ESTOP_TIMES = 3,
    ROUNDS_MAX = 100000, /* of PBKDF2: more would stop this thread */
    ROUNDS_MIN = 1000,   /* fewer let a rogue controller guess the key from our proof */
    LATE_MAX_MS = 1000,  /* a report that is older by more is of a controller that has started again */
};

bool peer_is_later(uint32_t one_us, uint32_t other_us) {
    return one_us != other_us && one_us - other_us <= INT32_MAX;
}

bool peer_awaits_homing(const struct peer *peer) {
    return peer->status.state == WIRE_STATE_ALARM && peer->status.alarm == WIRE_ALARM_LOCKED;
}

bool peer_is_locked(const struct peer *peer) {
    return peer->status.state == WIRE_STATE_ESTOP ||
           (peer->status.state == WIRE_STATE_ALARM && !peer_awaits_homing(peer));
}

const char *peer_refusal(unsigned refusal) {
    enum { COUNT = sizeof word_of_refusal / sizeof *word_of_refusal };
    return refusal < COUNT && word_of_refusal[refusal] != NULL ? word_of_refusal[refusal] : "unknown";
}

void peer_say(const struct peer *peer, const char *format, ...) {
    char text[PEER_WORDS_MAX];
    va_list values;
    va_start(values, format);
    vsnprintf(text, sizeof text, format, values);
    va_end(values);
    peer->world.say(peer->world.ctx, text);
}

// ---- to it ----

void peer_ask(struct peer *peer, uint8_t type, const void *payload, size_t size) {
    uint8_t message[CONTROL_MESSAGE_MAX];
    size_t count = control_ask(&peer->control, message, type, payload, size, peer->now_s);
    if (count == 0)
        peer->lost = "the controller answers nothing";
    else
        peer->world.send_tcp(peer->world.ctx, message, count);
}

void peer_post(struct peer *peer, uint8_t type, const void *payload, size_t size) {
    uint8_t packet[WIRE_PACKET_MAX];
    size_t count = control_pack(&peer->control, packet, type, payload, size, peer->now_s);
    peer->world.send_udp(peer->world.ctx, packet, seal_close(&peer->seal, packet, count));
}

static void say_hello(struct peer *peer) {
    uint8_t payload[WIRE_HANDSHAKE_SIZE];
    struct wire_handshake hello = {.host_version = VERSION_WORD, .host_name = "wificnc-hal"};
    wire_put_handshake(payload, &hello);
    peer_ask(peer, WIRE_HANDSHAKE, payload, sizeof payload);
}

void peer_begin(struct peer *peer, const struct peer_world *world, const struct peer_owner *owner,
                const char *key, double now_s) {
    *peer = (struct peer){.world = *world, .owner = *owner, .key = key, .now_s = now_s};
    peer->control.sequence = (uint32_t)(uint64_t)(1e6 * now_s); /* not that of the host program before */
    peer->heard_s = peer->pinged_s = now_s;
    peer->estop_s = now_s - ESTOP_WAY_S;
    peer->registered_s = now_s - REGISTER_S;
    if (key[0] != '\0')
        peer_ask(peer, WIRE_CHALLENGE, NULL, 0);
    else
        say_hello(peer);
}

/* LinuxCNC leaves its e-stop and asks for the reset immediately, but its threads bring us the one later than
 * the other. An e-stop that stays is not reset when it ends. */
static bool is_reset_due(struct peer *peer, bool estop, bool reset) {
    if (reset && !peer->was_reset) {
        peer->resets = true;
        peer->reset_s = peer->now_s;
    }
    if (!peer->resets || (!estop && peer->now_s - peer->estop_s >= ESTOP_WAY_S))
        return peer->resets;
    peer->resets = peer->now_s - peer->reset_s < RESET_MAX_S;
    return false;
}

bool peer_stop_and_reset(struct peer *peer, bool estop, bool reset) {
    bool stops = estop && !peer->was_estop;
    bool is_stopped = peer->is_known && peer->status.state == WIRE_STATE_ESTOP;
    unsigned times = stops ? ESTOP_TIMES : estop && !is_stopped ? 1 : 0; /* none may come after the reset */
    for (; times > 0; times--)
        peer_post(peer, WIRE_ESTOP, NULL, 0);
    if (stops)
        peer_ask(peer, WIRE_ESTOP, NULL, 0);
    peer->stop_is_unseen |= stops;
    if (estop)
        peer->estop_s = peer->now_s;
    bool begins = reset && !peer->was_reset;
    bool is_due = is_reset_due(peer, estop, reset);
    if (is_due && (peer->stop_is_unseen || (peer->is_known && peer_is_locked(peer))))
        peer_ask(peer, WIRE_RESET, NULL, 0);
    peer->resets = peer->resets && !is_due;
    peer->was_estop = estop;
    peer->was_reset = reset;
    return begins;
}

void peer_register(struct peer *peer) {
    uint8_t payload[WIRE_JOG_STOP_SIZE];
    wire_put_jog_stop(payload, &(struct wire_jog_stop){.axis = ALL_AXES});
    peer_post(peer, WIRE_JOG_STOP, payload, sizeof payload);
    peer->registered_s = peer->now_s;
}

static void ping(struct peer *peer) {
    uint8_t payload[WIRE_PING_SIZE];
    if (peer->now_s - peer->pinged_s < PING_S)
        return;
    wire_put_ping(payload, &(struct wire_ping){.id = peer->control.sequence});
    peer_ask(peer, WIRE_PING, payload, sizeof payload);
    peer->pinged_s = peer->now_s;
}

bool peer_tick(struct peer *peer, double now_s) {
    peer->now_s = now_s;
    if (now_s - peer->heard_s > SILENT_S)
        peer->lost = "the controller is silent";
    else if (control_silence_s(&peer->control, now_s) > SILENT_S)
        peer->lost = "the controller does not answer";
    if (peer->lost != NULL || !peer->is_up)
        return false;
    if (!peer->is_known && now_s - peer->registered_s >= REGISTER_S)
        peer_register(peer);
    ping(peer);
    return peer->lost == NULL;
}

// ---- from it ----

static void authenticate(struct peer *peer, const uint8_t *payload) {
    uint8_t request[WIRE_AUTHENTICATE_SIZE], secret[SHA256_SIZE];
    char normal[ACCESS_KEY_BYTES];
    struct wire_challenge_response asked;
    struct wire_authenticate given;
    wire_get_challenge_response(payload, &asked);
    size_t count = access_normal_key(peer->key, strlen(peer->key), normal);
    if (asked.rounds < ROUNDS_MIN || asked.rounds > ROUNDS_MAX) {
        peer->lost = "the controller does not know this protocol";
        return;
    }
    sha256_pbkdf2(normal, count, asked.salt, sizeof asked.salt, asked.rounds, secret);
    peer->world.random(peer->world.ctx, given.nonce, sizeof given.nonce);
    seal_derive(secret, asked.nonce, given.nonce, given.proof, peer->seal.key);
    wire_put_authenticate(request, &given);
    peer_ask(peer, WIRE_AUTHENTICATE, request, sizeof request);
}

static void begin_session(struct peer *peer, const uint8_t *payload) {
    struct wire_authenticated said;
    wire_get_authenticated(payload, &said);
    peer->seal.session = said.session;
    say_hello(peer);
}

static void take_hello(struct peer *peer, const uint8_t *payload) {
    struct wire_handshake_response hello;
    wire_get_handshake_response(payload, &hello);
    if ((hello.capabilities & WIRE_CAPABILITY_LOCKED) != 0 && peer->key[0] == '\0')
        peer->lost = "the controller is locked: wificnc linuxcnc pair";
    else
        peer->lost = peer->owner.greet(peer->owner.owner, &hello);
    peer->is_up = peer->lost == NULL;
}

static void begin_answered(struct peer *peer, const struct control_answer *answer) {
    if (answer->type == WIRE_REFUSED)
        peer->lost = answer->request == WIRE_AUTHENTICATE
                         ? "the controller refuses the access key: wificnc linuxcnc pair"
                         : "the controller does not know this protocol";
    else if (answer->request == WIRE_CHALLENGE)
        authenticate(peer, answer->payload);
    else if (answer->request == WIRE_AUTHENTICATE)
        begin_session(peer, answer->payload);
    else
        take_hello(peer, answer->payload);
}

static void answered(struct peer *peer, const struct control_answer *answer) {
    struct wire_refused refused;
    if (!peer->is_up) {
        begin_answered(peer, answer);
    } else if (answer->request == WIRE_RESET && answer->type == WIRE_REFUSED) {
        wire_get_refused(answer->payload, &refused);
        peer_say(peer, "the controller refuses to be reset: %s", peer_refusal(refused.reason));
    } else {
        peer->owner.answer(peer->owner.owner, answer);
    }
}

void peer_hear_tcp(struct peer *peer, const uint8_t *bytes, size_t count, double now_s) {
    struct control_answer answer;
    enum control_heard heard = CONTROL_ANSWER;
    peer->now_s = now_s;
    while (peer->lost == NULL &&
           (heard = control_hear(&peer->control, &bytes, &count, &answer)) == CONTROL_ANSWER)
        answered(peer, &answer);
    if (heard == CONTROL_NONSENSE)
        peer->lost = "the controller answers something else than it was asked";
}

static bool has_started_anew(const struct peer *peer, const struct wire_status *status) {
    uint32_t back_ms = peer->status.uptime_ms - status->uptime_ms;
    return peer->is_known && back_ms > LATE_MAX_MS && back_ms <= INT32_MAX;
}

double peer_blind_s(const struct peer *peer) {
    return fmax(0.0, peer->now_s - peer->status_s - peer->interval_s - NETWORK_S);
}

/* A single one may be early or late. */
static void note_interval(struct peer *peer) {
    const double gap_s = peer->now_s - peer->status_s;
    if (peer->is_known)
        peer->interval_s += peer->interval_s > 0.0 ? INTERVAL_PART * (gap_s - peer->interval_s) : gap_s;
    peer->status_s = peer->now_s;
}

static void take_status(struct peer *peer, const uint8_t *payload, uint32_t at_us) {
    struct wire_status status;
    wire_get_status(payload, &status);
    peer->heard_s = peer->now_s;
    if (has_started_anew(peer, &status))
        peer->lost = "the controller has restarted";
    else if (!peer->is_known || peer_is_later(at_us, peer->status_us)) {
        note_interval(peer);
        peer->status = status;
        peer->status_us = at_us;
        peer->is_known = true;
        peer->stop_is_unseen &= status.state != WIRE_STATE_ESTOP;
        peer->owner.report(peer->owner.owner);
    }
}

void peer_hear_udp(struct peer *peer, const uint8_t *packet, size_t size, double now_s) {
    struct wire_header header;
    peer->now_s = now_s;
    if (!peer->is_up || !wire_open(packet, size, &header))
        return;
    const uint8_t *payload = packet + WIRE_HEADER_SIZE;
    if (header.type != WIRE_STATUS)
        peer->owner.datagram(peer->owner.owner, &header, payload);
    else if (header.length >= WIRE_STATUS_SIZE)
        take_status(peer, payload, header.timestamp_us);
}
