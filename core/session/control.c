/* SPDX-License-Identifier: MIT
 * Requests by TCP, each with its one reply. */
#include "session/request.h"

#include <string.h>

enum { COUNTS_A_PULSE = 4 }; /* of an encoder with two lines */

/* The reply of a request that has none of its own: ack, or refused with the reason. */
static size_t judge(const struct request *request, enum wire_refusal refusal) {
    if (refusal == WIRE_REFUSAL_NONE) {
        struct wire_ack ack = {.sequence = request->header.sequence, .type = request->header.type};
        wire_put_ack(request_body(request), &ack);
        return request_reply(request, WIRE_ACK, WIRE_ACK_SIZE);
    }
    struct wire_refused refused = {
        .sequence = request->header.sequence, .type = request->header.type, .reason = (uint8_t)refusal};
    wire_put_refused(request_body(request), &refused);
    return request_reply(request, WIRE_REFUSED, WIRE_REFUSED_SIZE);
}

static struct wire_handshake_response about_machine(const struct machine *machine) {
    const struct machine_board *board = machine_board(machine);
    /* The handshake has pulses (lines) per revolution; the setting counts each edge of both channels. */
    unsigned pulses =
        machine_has_encoder(machine) ? machine_settings(machine)->encoder_counts / COUNTS_A_PULSE : 0u;
    return (struct wire_handshake_response){
        .axes = board->axis_count,
        .capabilities =
            (uint8_t)(WIRE_CAPABILITY_STREAM | (board->pump != NULL ? WIRE_CAPABILITY_CHARGE_PUMP : 0) |
                      (board->digital_outputs > 0 ? WIRE_CAPABILITY_MISC_OUTPUTS : 0) |
                      (board->digital_inputs > 0 ? WIRE_CAPABILITY_MISC_INPUTS : 0) |
                      ((board->outputs & BOARD_OUTPUT_PWM) != 0 ? WIRE_CAPABILITY_SPINDLE_PWM : 0) |
                      (pulses > 0 ? WIRE_CAPABILITY_ENCODER : 0)),
        .encoder_ppr_high = (uint8_t)(pulses >> 8),
        .encoder_ppr_low = (uint8_t)pulses,
        .buffer_capacity = HOST_QUEUE_SIZE,
        .step_rate_hz = board->max_step_rate_hz};
}

static struct wire_handshake_response about_module(const struct channels *channels) {
    return (struct wire_handshake_response){.capabilities = WIRE_CAPABILITY_IO_MODULE,
                                            .device_mode = CHANNELS_MODE_MODULE,
                                            .io_channels =
                                                (uint8_t)channels->config.value[CHANNELS_IO_COUNT]};
}

size_t request_handshake(const struct request *request) {
    const struct session *session = request->session;
    struct wire_handshake_response response = session_is_module(session)
                                                  ? about_module(session->options.channels)
                                                  : about_machine(session->machine);
    response.version = session->options.version;
    if (!access_may(session->options.access, lockout_ipv4(request->client->address)))
        response.capabilities |= WIRE_CAPABILITY_LOCKED;
    /* Ends with a zero whatever the name: hosts print it as a C string. */
    for (size_t i = 0; i < sizeof response.device_name - 2 && session->options.name[i] != '\0'; i++)
        response.device_name[i] = session->options.name[i];
    wire_put_handshake_response(request_body(request), &response);
    return request_reply(request, WIRE_HANDSHAKE_RESPONSE, WIRE_HANDSHAKE_RESPONSE_SIZE);
}

size_t request_config_get(const struct request *request) {
    struct wire_config_get get;
    struct wire_config_value value;
    wire_get_config_get(request->payload, &get);
    config_get(request->session, get.key, &value);
    wire_put_config_value(request_body(request), &value);
    return request_reply(request, WIRE_CONFIG_VALUE, WIRE_CONFIG_VALUE_SIZE);
}

enum wire_refusal request_config_set(const struct request *request) {
    struct wire_config_set set;
    wire_get_config_set(request->payload, &set);
    return config_set(request->session, &set);
}

size_t request_ping(const struct request *request) {
    struct wire_ping ping;
    wire_get_ping(request->payload, &ping);
    struct wire_pong reply = {.id = ping.id};
    wire_put_pong(request_body(request), &reply);
    return request_reply(request, WIRE_PONG, WIRE_PONG_SIZE);
}

/* Also why not is reported in its own reply. */
size_t request_stream_open(const struct request *request) {
    struct session *session = request->session;
    enum wire_refusal refusal = request->refusal;
    if (refusal == WIRE_REFUSAL_NONE)
        refusal = stream_open(session, request->place);
    struct wire_stream_opened opened = {.stream = refusal == WIRE_REFUSAL_NONE ? session->stream.id : 0,
                                        .capacity = HOST_QUEUE_SIZE,
                                        .refusal = (uint8_t)refusal};
    wire_put_stream_opened(request_body(request), &opened);
    return request_reply(request, WIRE_STREAM_OPENED, WIRE_STREAM_OPENED_SIZE);
}

enum wire_refusal request_stream_close(const struct request *request) {
    struct session *session = request->session;
    struct wire_stream_close close;
    wire_get_stream_close(request->payload, &close);
    /* Only by the connection that opened it; a new one of its host can still drop the stream
     * (request_stream_drop()). */
    if (!session->stream.open || close.stream != session->stream.id ||
        session->stream.client != request->place)
        return WIRE_REFUSAL_STREAM_CLOSED;
    stream_close(session, WIRE_REFUSAL_STREAM_CLOSED);
    return WIRE_REFUSAL_NONE;
}

/* Also after it was closed, or by a new connection of its host: what is queued may wait in a hold. */
enum wire_refusal request_stream_drop(const struct request *request) {
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

enum wire_refusal request_take(const struct request *request) {
    struct wire_take take;
    wire_get_take(request->payload, &take);
    session_take(request->session, request->client->address, take.discard != 0);
    return WIRE_REFUSAL_NONE;
}

size_t request_statistics(const struct request *request) {
    const struct session *session = request->session;
    const struct machine *machine = session->machine;
    struct wire_statistics_response counts = session->counts;
    if (machine != NULL) {
        counts.homed = machine_homed(machine);
        counts.position_losses = machine_position_losses(machine);
        counts.stretched = machine_host(machine)->queue.stretched;
        counts.underruns = machine_host(machine)->queue.underruns;
        counts.segments = machine_host_taken(machine);
        counts.done = machine_host_done(machine);
    }
    if (session->owner.on)
        memcpy(counts.owner, session->owner.address, sizeof counts.owner);
    wire_put_statistics_response(request_body(request), &counts);
    return request_reply(request, WIRE_STATISTICS_RESPONSE, WIRE_STATISTICS_RESPONSE_SIZE);
}

size_t request_probe_last(const struct request *request) {
    session_put_probe(request->session, request_body(request));
    return request_reply(request, WIRE_PROBE_RESULT, WIRE_PROBE_RESULT_SIZE);
}

size_t request_challenge(const struct request *request) {
    const struct session *session = request->session;
    struct session_client *client = request->client;
    struct wire_challenge_response response = {.rounds = ACCESS_ROUNDS};
    if (session->ops->random == NULL)
        return judge(request, WIRE_REFUSAL_AUTHENTICATION);
    /* A new number for each attempt: a proof that was recorded on the network is worth nothing later. */
    session->ops->random(session->ctx, client->nonce, sizeof client->nonce);
    client->has_nonce = true;
    memcpy(response.nonce, client->nonce, sizeof response.nonce);
    memcpy(response.salt, session->options.access->salt, sizeof response.salt);
    wire_put_challenge_response(request_body(request), &response);
    return request_reply(request, WIRE_CHALLENGE_RESPONSE, WIRE_CHALLENGE_RESPONSE_SIZE);
}

static uint32_t new_session(const struct session *session) {
    uint8_t bytes[4];
    session->ops->random(session->ctx, bytes, sizeof bytes);
    uint32_t number = (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16;
    return number | (uint32_t)(bytes[3] | 1) << 24; /* never 0 */
}

bool session_must_wait(struct session *session, int place, const uint8_t *message, size_t size) {
    struct session_client *client = &session->client[place];
    struct access *access = session->options.access;
    struct wire_header header;
    session_tick(session);
    if (!client->has_nonce || access->open || !wire_open(message, size, &header) ||
        header.type != WIRE_AUTHENTICATE)
        return false;
    if (!client->waits)
        client->tried_us = access->clock_us;
    client->waits = !access_is_turn(access, lockout_ipv4(client->address), client->tried_us);
    return client->waits;
}

size_t request_authenticate(const struct request *request) {
    const struct session *session = request->session;
    struct session_client *client = request->client;
    struct access *access = session->options.access;
    struct wire_authenticate given;
    struct seal seal = {0};
    uint8_t right[SHA256_SIZE];
    if (!client->has_nonce && !access->open)
        return judge(request, WIRE_REFUSAL_AUTHENTICATION);
    /* Before the proof is looked at: each number may be tried once, right or wrong. */
    client->has_nonce = false;
    wire_get_authenticate(request->payload, &given);
    seal_derive(access->secret, client->nonce, given.nonce, right, seal.key);
    if (!access->open && access_prove(access, lockout_ipv4(client->address), client->tried_us, given.proof,
                                      right) != ACCESS_GOOD)
        return judge(request, WIRE_REFUSAL_AUTHENTICATION);
    seal.session = new_session(session);
    client->seal = seal;
    client->authenticated = true;
    struct wire_authenticated said = {.session = seal.session};
    wire_put_authenticated(request_body(request), &said);
    return request_reply(request, WIRE_AUTHENTICATED, WIRE_AUTHENTICATED_SIZE);
}

enum wire_refusal request_config_save(const struct request *request) {
    return config_save(request->session);
}

enum wire_refusal request_command(const struct request *request) {
    return session_command(request->session, request->client->address, request->header.type,
                           request->payload);
}

/* What rules.c lets through. */
static size_t dispatch(const struct request *request) {
    for (size_t i = 0; i < request_handler_count; i++) {
        const struct request_handler *handler = &request_handlers[i];
        if (handler->type == request->header.type)
            return handler->answer != NULL ? handler->answer(request)
                                           : judge(request, handler->execute(request));
    }
    return judge(request, WIRE_REFUSAL_UNKNOWN_TYPE);
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
    bool may = request.client->authenticated ||
               access_may(session->options.access, lockout_ipv4(request.client->address));
    /* Before the check: a refused request is a sign of life, too, and its number is not missing. Not so what
     * another program of the owner's address sends, without the key. */
    if (may) {
        session_note_alive(session, request.client->address);
        session_note_sequence(session, request.client->address, request.header.sequence);
    }
    request.refusal = session_check_request(session, request.client, &request.header);
    if (may && session->options.device != NULL)
        device_contact(session->options.device, (unsigned)place);
    bool understood =
        request.refusal != WIRE_REFUSAL_UNKNOWN_TYPE && request.refusal != WIRE_REFUSAL_MALFORMED;
    /* stream_opened has a field for the refusal (docs/protocol.md), so it is the reply also when the rules
     * refuse. */
    bool answers_itself = request.header.type == WIRE_STREAM_OPEN && understood;
    return request.refusal == WIRE_REFUSAL_NONE || answers_itself ? dispatch(&request)
                                                                  : judge(&request, request.refusal);
}
