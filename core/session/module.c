/* SPDX-License-Identifier: MIT
 * A device that is an I/O module: hosts switch its outputs and hear of its inputs. It moves nothing.
 *
 * The host that commands lives while it has a TCP connection or was heard of within the time-out. When it is
 * gone, another one may command, and the outputs go to their safe state, unless they are configured to stay.
 */
#include "session/inner.h"

/* io_control has a byte for the outputs. */
enum { IO_CONTROL_CHANNELS = 0xFF };

static enum wire_refusal switch_outputs(struct session *session, const uint8_t *payload) {
    struct channels *channels = session->options.channels;
    struct wire_channel_outputs wanted;
    wire_get_channel_outputs(payload, &wanted);
    if ((wanted.channels & ~channels->wiring.outputs) != 0)
        return WIRE_REFUSAL_NOT_OUTPUT;
    channels_set(channels, wanted.channels, wanted.on);
    return WIRE_REFUSAL_NONE;
}

/* The full state of a motion controller's outputs; of it the misc ones are channels. */
static enum wire_refusal io_control(struct session *session, const uint8_t *payload) {
    struct wire_io_control wanted;
    wire_get_io_control(payload, &wanted);
    channels_set(session->options.channels, IO_CONTROL_CHANNELS, wanted.misc_outputs);
    return WIRE_REFUSAL_NONE;
}

static enum wire_refusal stop(struct session *session) {
    struct channels *channels = session->options.channels;
    channels_safe(channels);
    channels->locked = true;
    return WIRE_REFUSAL_NONE;
}

static enum wire_refusal reset(struct session *session) {
    session->options.channels->locked = false;
    return WIRE_REFUSAL_NONE;
}

enum wire_refusal module_command(struct session *session, const uint8_t address[4], uint8_t type,
                                 const uint8_t *payload) {
    if (type == WIRE_JOG_STOP)
        return WIRE_REFUSAL_NONE;
    if (type == WIRE_ESTOP)
        return stop(session);
    if (type == WIRE_RESET)
        return reset(session);
    if (session->options.channels->locked)
        return WIRE_REFUSAL_LOCKED;
    const enum wire_refusal refusal =
        type == WIRE_IO_CONTROL ? io_control(session, payload) : switch_outputs(session, payload);
    if (refusal == WIRE_REFUSAL_NONE)
        session_own(session, address);
    return refusal;
}

void module_poll(struct session *session) {
    struct channels *channels = session->options.channels;
    struct session_owner *owner = &session->owner;
    uint64_t timeout_us = channels->config.value[CHANNELS_IO_LINK_TIMEOUT] * 1000ull;
    channels_poll(channels, (uint32_t)session->now_us);
    if (!owner->on || session_has_client(session, owner->address) ||
        session->now_us - owner->heard_us < timeout_us)
        return;
    owner->on = false;
    if (channels->config.value[CHANNELS_IO_LINK_LOST] != 0)
        channels_safe(channels);
}

void module_status(const struct session *session, struct wire_status *status) {
    const struct channels *channels = session->options.channels;
    *status = (struct wire_status){
        .state = channels->locked ? WIRE_STATE_ESTOP : WIRE_STATE_IDLE,
        .alarm = channels->locked ? WIRE_ALARM_ESTOP : WIRE_ALARM_NONE,
        .io_inputs = channels_inputs(channels),
        .io_outputs = channels->outputs,
    };
}
