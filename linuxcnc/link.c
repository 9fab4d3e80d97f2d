/* SPDX-License-Identifier: MIT */
#include "link.h"

#include <stdarg.h>
#include <stdio.h>

static const double OUTPUTS_S = 0.1; /* outputs are said again this often: a datagram may be lost */

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
    const struct wire_status *status = &link->peer.status;
    bool holds = link_is_holding_feedback(link);
    show_inputs(pins, status);
    if (!holds)
        pins_show_position(pins, status->position_steps);
    if (!holds && !link->watches)
        *pins->probe = status->probe != 0;
    *pins->connected = true;
    *pins->homing = link->phase == LINK_HOMING || link->phase == LINK_HOMED;
    *pins->estopped = peer_is_locked(&link->peer);
    *pins->estop_ok = !peer_is_locked(&link->peer);
    *pins->ready = !peer_is_locked(&link->peer) && !*pins->fault;
    *pins->queue_ms = link->is_open ? 1e3 * link->queued_s : 0.0;
    if (link->is_open) {
        *pins->underruns = link->sender.underruns;
        *pins->datagrams = link->sender.sent;
    }
}

// ---- the controller ----

static const char *greet(void *owner, const struct wire_handshake_response *hello) {
    struct link *link = owner;
    link->has_encoder = (hello->capabilities & WIRE_CAPABILITY_ENCODER) != 0;
    if ((hello->capabilities & WIRE_CAPABILITY_IO_MODULE) != 0)
        return "this is an I/O module: --io-module";
    if ((hello->capabilities & WIRE_CAPABILITY_STREAM) == 0)
        return "the controller takes no streams: is it WiFiCNC?";
    if (hello->axes < link->options.joints)
        return "the controller has fewer axes than --joints says";
    peer_ask(&link->peer, WIRE_PROBE_LAST, NULL, 0);
    return NULL;
}

static void report(void *owner) {
    struct link *link = owner;
    if (link->has_encoder)
        encoder_take(&link->encoder, link->peer.status_us, link->peer.now_s, &link->peer.status);
    link_date_report(link);
    motion_note_off(link);
    show(link);
}

static void answer(void *owner, const struct control_answer *answer) {
    motion_answer(owner, answer);
}

static void datagram(void *owner, const struct wire_header *header, const uint8_t *payload) {
    struct wire_stream_ack ack;
    if (header->type != WIRE_STREAM_ACK || header->length < WIRE_STREAM_ACK_SIZE)
        return;
    wire_get_stream_ack(payload, &ack);
    motion_ack(owner, &ack, header->timestamp_us);
}

void link_begin(struct link *link, struct pins *pins, const struct peer_world *world,
                const struct link_options *options, double now_s) {
    const struct peer_owner owner = {link, greet, answer, report, datagram};
    *link = (struct link){.pins = pins, .options = *options};
    link->said_s = now_s - OUTPUTS_S;
    link->at_speed.run_up_s = options->run_up_s;
    link->at_speed.since_s = now_s;
    clearance_clear(&link->clearance, options->joints);
    link->was_enabled = *pins->enable; /* motion begins by switching on, not because there is a link */
    peer_begin(&link->peer, world, &owner, options->password, now_s);
    link->peer.was_reset = *pins->reset;
}

void link_date_report(struct link *link) {
    bool is_newer = link->peer.is_known && peer_is_later(link->peer.status_us, link->stale_us);
    link->is_stale = link->is_stale && !is_newer;
}

bool link_stands(const struct link *link) {
    const struct wire_status *status = &link->peer.status;
    if (!link->peer.is_known || link->is_stale || link->stream_asks > 0)
        return false;
    return (status->flags & WIRE_STATUS_FLAG_MOVING) == 0 && status->buffer_free == status->buffer_total &&
           status->state != WIRE_STATE_RUN && status->state != WIRE_STATE_PROBING &&
           status->state != WIRE_STATE_JOG && status->state != WIRE_STATE_HOMING;
}

void link_lose(struct pins *pins) {
    *pins->fault = *pins->fault || *pins->enable;
    *pins->connected = *pins->ready = *pins->estop_ok = *pins->homing = *pins->spindle_at_speed = false;
    *pins->queue_ms = 0.0;
}

void link_fault(struct link *link, const char *format, ...) {
    char text[PEER_WORDS_MOST];
    va_list values;
    va_start(values, format);
    vsnprintf(text, sizeof text, format, values);
    va_end(values);
    peer_say(&link->peer, "%s", text);
    *link->pins->fault = true;
    if (link->is_open)
        motion_close(link, link->sender.stream);
    link->phase = LINK_OFF;
}

// ---- from LinuxCNC ----

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
    if (is_same(&io, &link->said) && link->peer.now_s - link->said_s < OUTPUTS_S)
        return;
    uint8_t payload[WIRE_IO_CONTROL_SIZE];
    wire_put_io_control(payload, &io);
    peer_post(&link->peer, WIRE_IO_CONTROL, payload, sizeof payload);
    link->said = io;
    link->said_s = link->peer.now_s;
}

void link_follow_spindle(struct link *link, double now_s) {
    const struct pins *pins = link->pins;
    if (!link->peer.is_known)
        return;
    if (link->has_encoder) {
        bool armed = *pins->spindle_index_enable;
        bool was_armed = armed;
        *pins->spindle_revs = encoder_update(&link->encoder, now_s, &armed);
        *pins->spindle_speed_rps = encoder_speed_rps(&link->encoder);
        if (was_armed && !armed)
            *pins->spindle_index_enable = false;
    } else {
        *pins->spindle_speed_rps = (link->peer.status.spindle == 2 ? -1 : 1) * link->peer.status.rpm / 60.0;
    }
    *pins->spindle_at_speed = at_speed_update(&link->at_speed, now_s, &link->said, &link->peer.status,
                                              link->has_encoder ? &link->encoder : NULL);
}

// ---- the tick ----

static void post_segments(struct link *link) {
    uint8_t payload[SENDER_PAYLOAD_MOST];
    size_t size;
    while (link->is_open && (size = sender_poll(&link->sender, link->peer.now_s, payload)) > 0)
        peer_post(&link->peer, WIRE_STREAM_SEGMENTS, payload, size);
}

const char *link_tick(struct link *link, double now_s) {
    const struct pins *pins = link->pins;
    if (!link->peer.is_known)
        link->was_enabled = *pins->enable;
    if (!peer_tick(&link->peer, now_s))
        return link->peer.lost;
    if (link->peer.is_known)
        show(link);
    if (peer_stop_and_reset(&link->peer, *pins->estop, *pins->reset))
        *pins->fault = false;
    if (link->peer.is_known)
        motion_tick(link);
    post_segments(link);
    link_follow_spindle(link, now_s);
    say_outputs(link);
    return link->peer.lost;
}
