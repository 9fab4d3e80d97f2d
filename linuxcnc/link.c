/* SPDX-License-Identifier: MIT */
#include "link.h"
#include "words_gen.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

static const double OUTPUTS_S = 0.1; /* outputs are reported again this often: a datagram may be lost */
static const double TRUST_S = 0.2;   /* and whether the position is trusted is asked again */
static const double TRUST_SOON_S = 0.02;
enum { NO_STREAM = 2 }; /* the controller's have odd numbers: a question about none is answered, too */
static const double UNHOME_S = 0.25;     /* halui sees a pulse that is this long */
static const double RESET_SHOWN_S = 3.0; /* this long after it was asked for a reset may show success */
static const double RESET_MIN_S = 0.5;   /* the end of LinuxCNC's e-stop comes so much later */
static const double STOPPED_S = 2.0;     /* a report comes within it */
static const double RESET_DONE_S = 0.1;

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

static uint8_t homed_joints(const struct pins *pins) {
    uint8_t homed = 0;
    for (unsigned joint = 0; joint < pins->joints; joint++)
        homed |= (uint8_t)(*pins->joint[joint].homed << joint);
    return homed;
}

/* The position is known to be what LinuxCNC believes, and nothing is stopped that a reset would end. */
static bool is_fine(const struct link *link) {
    return link->reference.is_known && link->reference.lost == 0 && !peer_is_locked(&link->peer);
}

static void show_state(const struct link *link) {
    const struct pins *pins = link->pins;
    *pins->connected = true;
    *pins->homing = link->phase == LINK_HOMING || link->phase == LINK_HOMED;
    *pins->estopped = peer_is_locked(&link->peer);
    *pins->locked = peer_awaits_homing(&link->peer);
    *pins->estop_ok = is_fine(link);
    *pins->ready = is_fine(link) && !*pins->fault;
    *pins->held = link->is_held;
    *pins->feed_inhibit = link->is_held || link->is_late;
    *pins->message_link_lost = false;
    *pins->message_held = link->is_held && *pins->enable;
    *pins->message_home_first = link->phase == LINK_LOCKED;
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
    show_state(link);
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
    if (link->stream != 0) /* of the connection before */
        motion_drop(link, link->stream);
    return NULL;
}

void link_note_state(struct link *link, uint8_t state, uint32_t at_us) {
    bool is_first = link->state_us == 0 && link->state == 0;
    if (!is_first && !peer_is_later(at_us, link->state_us))
        return;
    bool is_held = state == WIRE_STATE_HOLD;
    if (is_held && !link->is_held)
        link->held_s = link->peer.now_s;
    link->is_held = is_held;
    link->state = state;
    link->state_us = at_us;
}

/* By a datagram: TCP takes long to recover when the network was gone. The acks of a stream say it, too. */
static void ask_trust(struct link *link) {
    bool is_urgent = !link->reference.is_known || link->phase == LINK_HOMED;
    if (link->peer.now_s - link->trust_s < (is_urgent ? TRUST_SOON_S : TRUST_S))
        return;
    uint8_t payload[WIRE_STREAM_SEGMENTS_SIZE];
    wire_put_stream_segments(payload, &(struct wire_stream_segments){.stream = NO_STREAM});
    peer_post(&link->peer, WIRE_STREAM_SEGMENTS, payload, sizeof payload);
    link->trust_s = link->peer.now_s;
}

static void take_trust(struct link *link, const struct wire_stream_ack *ack, uint32_t at_us) {
    if (link->trust_is_dated && !peer_is_later(at_us, link->trust_us))
        return;
    link->trust_is_dated = true;
    link->trust_us = at_us;
    if (link->is_open)
        link->trust_s = link->peer.now_s;
    reference_take(&link->reference, ack->homed, ack->position_losses);
    motion_take_trust(link, at_us);
}

static pin_BIT message_of_stop(const struct link *link) {
    const struct wire_status *status = &link->peer.status;
    if (status->state == WIRE_STATE_ESTOP)
        return link->pins->message_estop;
    bool is_limit = status->alarm >= WIRE_ALARM_LIMIT_X && status->alarm < WIRE_ALARM_LIMIT_X + PIN_JOINTS;
    return is_limit ? link->pins->message_limit : link->pins->message_alarm;
}

/* What has stopped the controller may have cost steps: until it has said, nothing is fine. */
static void look_for_lock(struct link *link) {
    bool is_locked = peer_is_locked(&link->peer);
    bool has_moved = link->was_stopped && link->peer.now_s - link->stopped_s < STOPPED_S;
    if (has_moved && peer_awaits_homing(&link->peer)) {
        link->was_stopped = false;
        motion_fault_ended(link);
    }
    if (is_locked && !link->was_locked) {
        if ((link->phase != LINK_OFF && !link->peer.was_estop) || has_moved)
            link_fault(link, message_of_stop(link), "the controller has stopped: %s; alarm %u",
                       word_of_state[link->peer.status.state & 7], link->peer.status.alarm);
        reference_forget(&link->reference);
        link->trust_is_dated = true;
        link->trust_us = link->peer.status_us;
    }
    link->was_locked = is_locked;
}

static void report(void *owner) {
    struct link *link = owner;
    reference_report(&link->reference, link->peer.status.uptime_ms, link->peer.now_s);
    look_for_lock(link);
    link_note_state(link, link->peer.status.state, link->peer.status_us);
    if (link->has_encoder)
        encoder_take(&link->encoder, link->peer.status_us, link->peer.now_s, &link->peer.status);
    link->reported_done = link->sender.done;
    link_date_report(link);
    motion_note_off(link);
    motion_check_position(link);
    show(link);
}

static void answer(void *owner, const struct control_answer *answer) {
    motion_answer(owner, answer);
}

static void datagram(void *owner, const struct wire_header *header, const uint8_t *payload) {
    struct link *link = owner;
    struct wire_stream_ack ack;
    if (header->type != WIRE_STREAM_ACK || header->length < WIRE_STREAM_ACK_SIZE)
        return;
    wire_get_stream_ack(payload, &ack);
    take_trust(link, &ack, header->timestamp_us);
    motion_ack(link, &ack, header->timestamp_us);
}

void link_begin(struct link *link, struct pins *pins, const struct peer_world *world,
                const struct link_options *options, double now_s) {
    const struct peer_owner owner = {link, greet, answer, report, datagram};
    struct reference reference = link->reference;
    uint32_t stream = link->stream;
    if (!reference.is_begun)
        reference_begin(&reference, homed_joints(pins));
    reference_forget(&reference);
    *link = (struct link){.pins = pins, .options = *options, .reference = reference, .stream = stream};
    link->reset_done_s = now_s - RESET_DONE_S;
    link->trust_s = now_s - TRUST_S;
    link->said_s = now_s - OUTPUTS_S;
    link->at_speed.run_up_s = options->run_up_s;
    link->at_speed.since_s = now_s;
    clearance_clear(&link->clearance, options->joints);
    link->was_enabled = *pins->enable; /* motion begins by switching on, not because there is a link */
    peer_begin(&link->peer, world, &owner, options->key, now_s);
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
    *pins->held = *pins->feed_inhibit = *pins->locked = *pins->reset_done = false;
    *pins->message_link_lost = true;
    *pins->queue_ms = 0.0;
}

/* The operator has seen them. */
static void clear_messages(const struct pins *pins) {
    *pins->fault = false;
    *pins->message_estop = *pins->message_limit = *pins->message_alarm = *pins->message_homing = false;
    *pins->message_late = *pins->message_ended = *pins->message_moved = *pins->message_refused = false;
    *pins->message_servo = false;
}

void link_fault(struct link *link, pin_BIT message, const char *format, ...) {
    char text[PEER_WORDS_MAX];
    va_list values;
    va_start(values, format);
    vsnprintf(text, sizeof text, format, values);
    va_end(values);
    peer_say(&link->peer, "%s", text);
    *link->pins->fault = *message = true;
    if (link->is_open)
        motion_drop(link, link->sender.stream);
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
    if (io.spindle != link->said.spindle || io.coolant != link->said.coolant) /* this one is answered */
        peer_ask(&link->peer, WIRE_IO_CONTROL, payload, sizeof payload);
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
    uint8_t payload[SENDER_PAYLOAD_MAX];
    size_t size;
    while (link->is_open && (size = sender_poll(&link->sender, link->peer.now_s, payload)) > 0)
        peer_post(&link->peer, WIRE_STREAM_SEGMENTS, payload, size);
}

/* What was homed is lost: LinuxCNC's halui takes a pulse for each joint. */
static void follow_reference(struct link *link) {
    const struct pins *pins = link->pins;
    uint8_t lost = reference_follow(&link->reference, homed_joints(pins));
    bool pulse = !*pins->enable && fmod(link->peer.now_s, 2.0 * UNHOME_S) < UNHOME_S;
    for (unsigned joint = 0; joint < pins->joints; joint++)
        *pins->joint[joint].unhome = pulse && (lost >> joint & 1) != 0;
    if (lost != 0 && !*pins->message_unhomed)
        peer_say(&link->peer, "the controller has lost the position of homed joints: home them again");
    *pins->message_unhomed = lost != 0;
    ask_trust(link);
}

/* An e-stop latch is to be reset when all is fine, and not before. */
static void follow_reset(struct link *link, bool begins) {
    const struct pins *pins = link->pins;
    double now_s = link->peer.now_s;
    if (begins) {
        clear_messages(pins);
        link->resets = true;
        link->resets_s = now_s;
    }
    double most_s = *pins->estop ? RESET_MIN_S : RESET_SHOWN_S;
    link->resets = link->resets && now_s - link->resets_s < most_s;
    if (link->resets && is_fine(link)) {
        link->resets = false;
        link->reset_done_s = now_s;
    }
    *pins->reset_done = now_s - link->reset_done_s < RESET_DONE_S;
}

void link_note_lost_samples(struct link *link, uint32_t lost) {
    uint32_t more = lost - link->samples_lost;
    link->samples_lost = *link->pins->samples_lost = lost;
    if (more > 0 && link->phase != LINK_OFF)
        link_fault(link, link->pins->message_servo,
                   "the sampler could not keep %u servo periods: this program did not run in time, and what "
                   "LinuxCNC commanded in them is not known",
                   (unsigned)more);
}

const char *link_tick(struct link *link, double now_s) {
    const struct pins *pins = link->pins;
    if (!link->peer.is_known)
        link->was_enabled = *pins->enable;
    if (!peer_tick(&link->peer, now_s))
        return link->peer.lost;
    if (link->peer.is_known)
        show(link);
    follow_reset(link, peer_stop_and_reset(&link->peer, *pins->estop, *pins->reset));
    if (link->peer.is_known) {
        follow_reference(link);
        motion_tick(link);
    }
    post_segments(link);
    link_follow_spindle(link, now_s);
    say_outputs(link);
    return link->peer.lost;
}
