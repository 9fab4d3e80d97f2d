/* SPDX-License-Identifier: MIT */
#include "link.h"

#include "base/sha256.h"
#include "base/version.h"
#include "wire/bytes.h"
#include "words_gen.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const double OUTPUTS_S = 0.1; /* outputs are said again this often: a datagram may be lost */
static const double PING_S = 5.0;
static const double SILENT_S = 1.0; /* without a report or an answer for so long the controller is gone */
enum { ALL_AXES = 0xFF, ESTOP_TIMES = 3, WORDS_MOST = 200 };

static bool is_locked(const struct wire_status *status) {
    return status->state == WIRE_STATE_ALARM || status->state == WIRE_STATE_ESTOP;
}

/* Of a clock that wraps. */
static bool is_later(uint32_t one_us, uint32_t other_us) {
    return one_us != other_us && one_us - other_us <= INT32_MAX;
}

// ---- to the controller ----

void link_ask(struct link *link, uint8_t type, const void *payload, size_t size) {
    uint8_t message[CONTROL_MESSAGE_MOST];
    size_t count = control_ask(&link->control, message, type, payload, size, link->now_s);
    if (count == 0)
        link->lost = "the controller answers nothing";
    else
        link->world.send_tcp(link->world.ctx, message, count);
}

void link_post(struct link *link, uint8_t type, const void *payload, size_t size) {
    uint8_t packet[WIRE_PACKET_MOST];
    size_t count = control_pack(&link->control, packet, type, payload, size, link->now_s);
    link->world.send_udp(link->world.ctx, packet, count);
}

static void say_hello(struct link *link) {
    uint8_t payload[WIRE_HANDSHAKE_SIZE];
    struct wire_handshake hello = {.host_version = VERSION_WORD, .host_name = "wificnc-hal"};
    wire_put_handshake(payload, &hello);
    link_ask(link, WIRE_HANDSHAKE, payload, sizeof payload);
    link_ask(link, WIRE_PROBE_LAST, NULL, 0);
}

void link_begin(struct link *link, struct pins *pins, const struct link_world *world,
                const struct link_options *options, double now_s) {
    uint32_t sequence = (uint32_t)(uint64_t)(1e6 * now_s); /* not that of the host program before */
    *link = (struct link){.pins = pins, .world = *world, .options = *options, .now_s = now_s};
    link->control.sequence = sequence;
    link->heard_s = link->pinged_s = now_s;
    link->said_s = now_s - OUTPUTS_S;
    link->at_speed.run_up_s = options->run_up_s;
    link->at_speed.since_s = now_s;
    clearance_clear(&link->clearance, options->joints);
    if (options->password[0] != '\0')
        link_ask(link, WIRE_CHALLENGE, NULL, 0);
    else
        say_hello(link);
}

// ---- to LinuxCNC ----

static void show_inputs(const struct pins *pins, const struct wire_status *status) {
    for (unsigned joint = 0; joint < pins->joints; joint++) {
        *pins->joint[joint].limit = (status->limits >> joint & 1) != 0;
        *pins->joint[joint].home_switch = (status->home_switches >> joint & 1) != 0;
    }
    for (unsigned number = 0; number < PIN_INPUTS; number++) {
        *pins->digital_in[number] = (status->misc_inputs >> number & 1) != 0;
        *pins->digital_in_not[number] = (status->misc_inputs >> number & 1) == 0;
    }
}

static void show(struct link *link) {
    const struct pins *pins = link->pins;
    const struct wire_status *status = &link->status;
    bool holds = link_is_holding_feedback(link);
    show_inputs(pins, status);
    if (!holds)
        pins_show_position(pins, status->position_steps);
    if (!holds && !link->watches)
        *pins->probe = status->probe != 0;
    *pins->connected = true;
    *pins->homing = link->phase == LINK_HOMING || link->phase == LINK_HOMED;
    *pins->estopped = is_locked(status);
    *pins->estop_ok = !is_locked(status);
    *pins->ready = !is_locked(status) && !*pins->fault;
    *pins->queue_ms = link->is_open ? 1e3 * link->queued_s : 0.0;
    if (link->is_open) {
        *pins->underruns = link->sender.underruns;
        *pins->datagrams = link->sender.sent;
    }
}

// ---- from the controller ----

static void authenticate(struct link *link, const uint8_t *nonce) {
    uint8_t proof[SHA256_SIZE];
    const char *password = link->options.password;
    sha256_hmac(password, strlen(password), nonce, WIRE_CHALLENGE_RESPONSE_SIZE, proof);
    link_ask(link, WIRE_AUTHENTICATE, proof, sizeof proof);
}

/* Its reports come to whoever has sent it a datagram. */
static void register_for_reports(struct link *link) {
    uint8_t payload[WIRE_JOG_STOP_SIZE];
    wire_put_jog_stop(payload, &(struct wire_jog_stop){.axis = ALL_AXES});
    link_post(link, WIRE_JOG_STOP, payload, sizeof payload);
}

static void greet(struct link *link, const struct control_answer *answer) {
    if (answer->type == WIRE_REFUSED) {
        link->lost = answer->request == WIRE_AUTHENTICATE ? "the controller refuses the password: --password"
                                                          : "the controller does not know this protocol";
    } else if (answer->request == WIRE_CHALLENGE) {
        authenticate(link, answer->payload);
    } else if (answer->request == WIRE_AUTHENTICATE) {
        say_hello(link);
    } else if (answer->request == WIRE_HANDSHAKE) {
        struct wire_handshake_response hello;
        wire_get_handshake_response(answer->payload, &hello);
        link->has_encoder = (hello.capabilities & WIRE_CAPABILITY_ENCODER) != 0;
        if ((hello.capabilities & WIRE_CAPABILITY_STREAM) == 0)
            link->lost = "the controller takes no streams: is it WiFiCNC, and no I/O module?";
        else if (hello.axes < link->options.joints)
            link->lost = "the controller has fewer axes than --joints says";
        else if ((hello.capabilities & WIRE_CAPABILITY_LOCKED) != 0 && link->options.password[0] == '\0')
            link->lost = "the controller wants a password: --password";
    } else if (answer->request == WIRE_PROBE_LAST) {
        struct wire_probe_result result;
        wire_get_probe_result(answer->payload, &result);
        link->results = result.number;
        link->is_up = true;
        register_for_reports(link);
    }
}

static void answered(struct link *link, const struct control_answer *answer) {
    if (!link->is_up) {
        greet(link, answer);
    } else if (answer->request == WIRE_RESET && answer->type == WIRE_REFUSED) {
        char text[WORDS_MOST];
        unsigned reason = get_u8(answer->payload + 5);
        snprintf(text, sizeof text, "the controller refuses to be reset: reason %u", reason);
        link->world.say(link->world.ctx, text);
    } else {
        motion_answer(link, answer);
    }
}

void link_hear_tcp(struct link *link, const uint8_t *bytes, size_t count, double now_s) {
    struct control_answer answer;
    enum control_heard heard = CONTROL_ANSWER;
    link->now_s = now_s;
    while (link->lost == NULL &&
           (heard = control_hear(&link->control, &bytes, &count, &answer)) == CONTROL_ANSWER)
        answered(link, &answer);
    if (heard == CONTROL_NONSENSE)
        link->lost = "the controller answers something else than it was asked";
}

static void hear_status(struct link *link, const uint8_t *payload, uint32_t at_us) {
    struct wire_status status;
    wire_get_status(payload, &status);
    link->heard_s = link->now_s;
    if (!link->is_known || is_later(at_us, link->status_us)) {
        link->status = status;
        link->status_us = at_us;
        link->is_known = true;
    }
    if (link->has_encoder)
        encoder_take(&link->encoder, at_us, link->now_s, &status);
    show(link);
}

void link_hear_udp(struct link *link, const uint8_t *packet, size_t size, double now_s) {
    struct wire_header header;
    link->now_s = now_s;
    if (!link->is_up || !wire_open(packet, size, &header))
        return;
    const uint8_t *payload = packet + WIRE_HEADER_SIZE;
    if (header.type == WIRE_STATUS && header.length >= WIRE_STATUS_SIZE) {
        hear_status(link, payload, header.timestamp_us);
    } else if (header.type == WIRE_STREAM_ACK && header.length >= WIRE_STREAM_ACK_SIZE) {
        struct wire_stream_ack ack;
        wire_get_stream_ack(payload, &ack);
        motion_ack(link, &ack, header.timestamp_us);
    }
}

bool link_stands(const struct link *link) {
    if (!link->is_known || (link->is_closed && !is_later(link->status_us, link->closed_us)))
        return false;
    return (link->status.flags & WIRE_STATUS_FLAG_MOVING) == 0 && link->status.state != WIRE_STATE_RUN &&
           link->status.state != WIRE_STATE_PROBING;
}

void link_lose(struct pins *pins) {
    *pins->fault = *pins->fault || *pins->enable;
    *pins->connected = *pins->ready = *pins->estop_ok = *pins->homing = *pins->spindle_at_speed = false;
    *pins->queue_ms = 0.0;
}

void link_fault(struct link *link, const char *format, ...) {
    char text[WORDS_MOST];
    va_list values;
    va_start(values, format);
    vsnprintf(text, sizeof text, format, values);
    va_end(values);
    link->world.say(link->world.ctx, text);
    *link->pins->fault = true;
    if (link->is_open) {
        uint8_t payload[WIRE_STREAM_CLOSE_SIZE];
        wire_put_stream_close(payload, &(struct wire_stream_close){.stream = link->sender.stream});
        link_ask(link, WIRE_STREAM_CLOSE, payload, sizeof payload);
    }
    link->is_open = link->watches = false;
    link->phase = LINK_OFF;
}

// ---- from LinuxCNC ----

static void stop_and_reset(struct link *link) {
    bool estop = *link->pins->estop, reset = *link->pins->reset;
    unsigned times = !estop ? 0 : link->was_estop ? 1 : ESTOP_TIMES; /* and every tick as long as it is */
    for (; times > 0; times--)
        link_post(link, WIRE_ESTOP, NULL, 0);
    if (reset && !link->was_reset) {
        *link->pins->fault = false;
        if (link->is_known && is_locked(&link->status))
            link_ask(link, WIRE_RESET, NULL, 0);
    }
    link->was_estop = estop;
    link->was_reset = reset;
}

static uint16_t whole_rpm(double rpm) {
    double size = rpm < 0.0 ? -rpm : rpm;
    return size < 65534.5 ? (uint16_t)(size + 0.5) : size >= 65534.5 ? 65535 : 0;
}

static bool is_same(const struct wire_io_control *one, const struct wire_io_control *other) {
    return one->misc_outputs == other->misc_outputs && one->spindle == other->spindle &&
           one->rpm == other->rpm && one->coolant == other->coolant;
}

static void say_outputs(struct link *link) {
    const struct pins *pins = link->pins;
    struct wire_io_control io = {.rpm = whole_rpm(*pins->spindle_rpm)};
    for (unsigned number = 0; number < PIN_OUTPUTS; number++)
        io.misc_outputs |= (uint8_t)(*pins->digital_out[number] << number);
    if (*pins->spindle_on)
        io.spindle = *pins->spindle_reverse ? 2 : 1;
    io.coolant = (uint8_t)((*pins->flood ? 1 : 0) | (*pins->mist ? 2 : 0));
    if (is_same(&io, &link->said) && link->now_s - link->said_s < OUTPUTS_S)
        return;
    uint8_t payload[WIRE_IO_CONTROL_SIZE];
    wire_put_io_control(payload, &io);
    link_post(link, WIRE_IO_CONTROL, payload, sizeof payload);
    link->said = io;
    link->said_s = link->now_s;
}

void link_follow_spindle(struct link *link, double now_s) {
    const struct pins *pins = link->pins;
    if (!link->is_known)
        return;
    if (link->has_encoder) {
        bool armed = *pins->spindle_index_enable;
        bool was_armed = armed;
        *pins->spindle_revs = encoder_update(&link->encoder, now_s, &armed);
        *pins->spindle_speed_rps = encoder_speed_rps(&link->encoder);
        if (was_armed && !armed)
            *pins->spindle_index_enable = false;
    } else {
        *pins->spindle_speed_rps = (link->status.spindle == 2 ? -1 : 1) * link->status.rpm / 60.0;
    }
    *pins->spindle_at_speed = at_speed_update(&link->at_speed, now_s, &link->said, &link->status,
                                              link->has_encoder ? &link->encoder : NULL);
}

// ---- the tick ----

static void ping(struct link *link) {
    if (link->now_s - link->pinged_s < PING_S)
        return;
    uint8_t payload[WIRE_PING_SIZE];
    wire_put_ping(payload, &(struct wire_ping){.id = link->control.sequence});
    link_ask(link, WIRE_PING, payload, sizeof payload);
    link->pinged_s = link->now_s;
}

static void post_segments(struct link *link) {
    uint8_t payload[SENDER_PAYLOAD_MOST];
    size_t size;
    while (link->is_open && (size = sender_poll(&link->sender, link->now_s, payload)) > 0)
        link_post(link, WIRE_STREAM_SEGMENTS, payload, size);
}

const char *link_tick(struct link *link, double now_s) {
    link->now_s = now_s;
    if (now_s - link->heard_s > SILENT_S)
        link->lost = "the controller is silent";
    else if (control_silence_s(&link->control, now_s) > SILENT_S)
        link->lost = "the controller does not answer";
    if (link->lost != NULL || !link->is_up)
        return link->lost;
    if (link->is_known)
        show(link);
    stop_and_reset(link);
    if (link->is_known)
        motion_tick(link);
    post_segments(link);
    link_follow_spindle(link, now_s);
    say_outputs(link);
    ping(link);
    return link->lost;
}
