/* SPDX-License-Identifier: MIT
 * Requests by TCP, each with its one reply. */
#include "session/inner.h"

#include "base/sha256.h"

#include <string.h>

enum { COUNTS_A_PULSE = 4 }; /* of an encoder with two lines */

/* A request under way. */
struct request {
    struct session *session;
    struct session_client *client;
    int place;
    struct wire_header header;
    const uint8_t *payload;
    uint8_t *reply;
};

static size_t answer(const struct request *request, enum wire_type type, size_t payload_size) {
    return session_close(request->session, SEQUENCE_REPLY, request->reply, type, payload_size);
}

static uint8_t *body(const struct request *request) {
    return request->reply + WIRE_HEADER_SIZE;
}

/* ack, or refused and why. */
static size_t judge(const struct request *request, enum wire_refusal refusal) {
    if (refusal == WIRE_REFUSAL_NONE) {
        struct wire_ack ack = {.sequence = request->header.sequence, .type = request->header.type};
        wire_put_ack(body(request), &ack);
        return answer(request, WIRE_ACK, WIRE_ACK_SIZE);
    }
    struct wire_refused refused = {
        .sequence = request->header.sequence, .type = request->header.type, .reason = (uint8_t)refusal};
    wire_put_refused(body(request), &refused);
    return answer(request, WIRE_REFUSED, WIRE_REFUSED_SIZE);
}

static struct wire_handshake_response about_machine(const struct machine *machine) {
    const struct machine_board *board = machine_board(machine);
    unsigned pulses =
        machine_has_encoder(machine) ? machine_settings(machine)->encoder_counts / COUNTS_A_PULSE : 0u;
    return (struct wire_handshake_response){
        .axes = board->axis_count,
        .capabilities =
            (uint8_t)(WIRE_CAPABILITY_STREAM | (board->charge_pump_hz > 0 ? WIRE_CAPABILITY_CHARGE_PUMP : 0) |
                      (board->digital_outputs > 0 ? WIRE_CAPABILITY_MISC_OUTPUTS : 0) |
                      (board->digital_inputs > 0 ? WIRE_CAPABILITY_MISC_INPUTS : 0) |
                      ((board->outputs & BOARD_OUTPUT_PWM) != 0 ? WIRE_CAPABILITY_SPINDLE_PWM : 0) |
                      (pulses > 0 ? WIRE_CAPABILITY_ENCODER : 0)),
        .encoder_ppr_high = (uint8_t)(pulses >> 8),
        .encoder_ppr_low = (uint8_t)pulses,
        .buffer_capacity = FEED_SIZE,
        .step_rate_hz = board->max_step_rate_hz};
}

static struct wire_handshake_response about_module(const struct channels *channels) {
    return (struct wire_handshake_response){.capabilities = WIRE_CAPABILITY_IO_MODULE,
                                            .device_mode = CHANNELS_MODE_MODULE,
                                            .io_channels =
                                                (uint8_t)channels->config.value[CHANNELS_IO_COUNT]};
}

static size_t handshake(const struct request *request) {
    const struct session *session = request->session;
    struct wire_handshake_response response = session_is_module(session)
                                                  ? about_module(session->options.channels)
                                                  : about_machine(session->machine);
    response.version = session->options.version;
    if (session->options.password[0] != '\0')
        response.capabilities |= WIRE_CAPABILITY_LOCKED;
    for (size_t i = 0; i < sizeof response.device_name - 2 && session->options.name[i] != '\0'; i++)
        response.device_name[i] = session->options.name[i];
    wire_put_handshake_response(body(request), &response);
    return answer(request, WIRE_HANDSHAKE_RESPONSE, WIRE_HANDSHAKE_RESPONSE_SIZE);
}

static size_t get_key(const struct request *request) {
    struct wire_config_get get;
    struct wire_config_value value;
    wire_get_config_get(request->payload, &get);
    config_get(request->session, get.key, &value);
    wire_put_config_value(body(request), &value);
    return answer(request, WIRE_CONFIG_VALUE, WIRE_CONFIG_VALUE_SIZE);
}

static enum wire_refusal set_key(const struct request *request) {
    struct wire_config_set set;
    wire_get_config_set(request->payload, &set);
    return config_set(request->session, &set);
}

static size_t pong(const struct request *request) {
    struct wire_ping ping;
    wire_get_ping(request->payload, &ping);
    struct wire_pong reply = {.id = ping.id};
    wire_put_pong(body(request), &reply);
    return answer(request, WIRE_PONG, WIRE_PONG_SIZE);
}

/* Also why not is said in its own reply. */
static size_t open_stream(const struct request *request, enum wire_refusal refusal) {
    struct session *session = request->session;
    if (refusal == WIRE_REFUSAL_NONE)
        refusal = stream_open(session, request->place);
    struct wire_stream_opened opened = {.stream = refusal == WIRE_REFUSAL_NONE ? session->stream.id : 0,
                                        .capacity = FEED_SIZE,
                                        .refusal = (uint8_t)refusal};
    wire_put_stream_opened(body(request), &opened);
    return answer(request, WIRE_STREAM_OPENED, WIRE_STREAM_OPENED_SIZE);
}

static enum wire_refusal close_stream(const struct request *request) {
    struct session *session = request->session;
    struct wire_stream_close close;
    wire_get_stream_close(request->payload, &close);
    if (!session->stream.open || close.stream != session->stream.id ||
        session->stream.client != request->place)
        return WIRE_REFUSAL_STREAM_CLOSED;
    stream_close(session, WIRE_REFUSAL_STREAM_CLOSED);
    return WIRE_REFUSAL_NONE;
}

/* Also after it was closed, or by a new connection of its host: what is queued may wait in a hold. */
static enum wire_refusal drop_stream(const struct request *request) {
    struct session *session = request->session;
    struct wire_stream_drop drop;
    wire_get_stream_drop(request->payload, &drop);
    if (drop.stream == 0 || drop.stream != session->stream.id ||
        !session_same(session->owner.address, request->client->address))
        return WIRE_REFUSAL_STREAM_CLOSED;
    stream_close(session, WIRE_REFUSAL_STREAM_CLOSED);
    machine_host_discard(session->machine);
    return WIRE_REFUSAL_NONE;
}

static size_t statistics(const struct request *request) {
    const struct session *session = request->session;
    const struct machine *machine = session->machine;
    struct wire_statistics_response counts = session->counts;
    if (machine != NULL) {
        counts.homed = machine_homed(machine);
        counts.position_losses = machine_position_losses(machine);
        counts.stretched = machine_host(machine)->feed.stretched;
        counts.underruns = machine_host(machine)->feed.underruns;
        counts.segments = machine_host_taken(machine);
        counts.done = machine_host_done(machine);
    }
    if (session->owner.on)
        memcpy(counts.owner, session->owner.address, sizeof counts.owner);
    wire_put_statistics_response(body(request), &counts);
    return answer(request, WIRE_STATISTICS_RESPONSE, WIRE_STATISTICS_RESPONSE_SIZE);
}

static size_t last_probe(const struct request *request) {
    session_put_probe(request->session, body(request));
    return answer(request, WIRE_PROBE_RESULT, WIRE_PROBE_RESULT_SIZE);
}

static size_t challenge(const struct request *request) {
    struct session_client *client = request->client;
    struct wire_challenge_response response;
    if (request->session->ops->random == NULL)
        return judge(request, WIRE_REFUSAL_AUTHENTICATION);
    request->session->ops->random(request->session->ctx, client->nonce, sizeof client->nonce);
    client->has_nonce = true;
    memcpy(response.nonce, client->nonce, sizeof response.nonce);
    wire_put_challenge_response(body(request), &response);
    return answer(request, WIRE_CHALLENGE_RESPONSE, WIRE_CHALLENGE_RESPONSE_SIZE);
}

static enum wire_refusal authenticate(const struct request *request) {
    struct session *session = request->session;
    struct session_client *client = request->client;
    const char *password = session->options.password;
    struct wire_authenticate given;
    uint8_t right[SHA256_SIZE];
    uint64_t who = lockout_ipv4(client->address);
    uint32_t now_us = (uint32_t)session->now_us;
    if (password[0] == '\0') /* everybody may, also who says one */
        return WIRE_REFUSAL_NONE;
    if (!client->has_nonce || !lockout_may_try(&session->lockout, who, now_us))
        return WIRE_REFUSAL_AUTHENTICATION;
    client->has_nonce = false;
    wire_get_authenticate(request->payload, &given);
    sha256_hmac(password, strlen(password), client->nonce, sizeof client->nonce, right);
    bool good = sha256_is_equal(right, given.proof);
    lockout_note(&session->lockout, who, good, now_us);
    if (!good)
        return WIRE_REFUSAL_AUTHENTICATION;
    client->authenticated = true;
    return WIRE_REFUSAL_NONE;
}

/* What rules.c lets through. */
static size_t dispatch(const struct request *request) {
    switch (request->header.type) {
    case WIRE_HANDSHAKE:
        return handshake(request);
    case WIRE_CONFIG_GET:
        return get_key(request);
    case WIRE_CONFIG_SET:
        return judge(request, set_key(request));
    case WIRE_CONFIG_SAVE:
        return judge(request, config_save(request->session));
    case WIRE_PING:
        return pong(request);
    case WIRE_STREAM_CLOSE:
        return judge(request, close_stream(request));
    case WIRE_STREAM_DROP:
        return judge(request, drop_stream(request));
    case WIRE_PROBE_LAST:
        return last_probe(request);
    case WIRE_STATISTICS:
        return statistics(request);
    case WIRE_CHALLENGE:
        return challenge(request);
    case WIRE_AUTHENTICATE:
        return judge(request, authenticate(request));
    default:
        return judge(request, session_command(request->session, request->client->address,
                                              request->header.type, request->payload));
    }
}

size_t session_request(struct session *session, int place, const uint8_t *message, size_t size,
                       uint8_t *reply) {
    struct request request = {.session = session,
                              .client = &session->client[place],
                              .place = place,
                              .payload = message + WIRE_HEADER_SIZE,
                              .reply = reply};
    session_tick(session);
    request.client->heard_us = session->now_us;
    if (!wire_open(message, size, &request.header)) {
        session->counts.malformed++;
        return 0;
    }
    session_note_alive(session, request.client->address);
    session_note_sequence(session, request.client->address, request.header.sequence);
    enum wire_refusal refusal = session_check_request(session, request.client, &request.header);
    bool understood = refusal != WIRE_REFUSAL_UNKNOWN_TYPE && refusal != WIRE_REFUSAL_MALFORMED;
    if (request.header.type == WIRE_STREAM_OPEN && understood)
        return open_stream(&request, refusal);
    return refusal == WIRE_REFUSAL_NONE ? dispatch(&request) : judge(&request, refusal);
}
