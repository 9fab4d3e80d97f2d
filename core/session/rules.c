/* SPDX-License-Identifier: MIT
 * What a packet of a host needs before anything looks into it: its channel, its length, a machine or a module
 * behind this device, and that this host may command. */
#include "session/inner.h"

#include <stddef.h>

enum {
    UDP = 1,
    TCP = 2,
    ANY = UDP | TCP,
};
enum {
    MACHINE = 1, /* what an I/O module has not */
    MODULE = 2,  /* what only an I/O module has */
    MAY = 4,     /* authenticated, and no other host commands */
};

struct rule {
    uint8_t type; /* enum wire_type */
    uint8_t channels;
    uint8_t least; /* payload, bytes */
    uint8_t needs;
};

static const struct rule rules[] = {
    {WIRE_MOTION, UDP, WIRE_MOTION_SIZE, MACHINE | MAY},
    {WIRE_STREAM_SEGMENTS, UDP, WIRE_STREAM_SEGMENTS_SIZE, MACHINE | MAY},
    {WIRE_JOG, ANY, WIRE_JOG_SIZE, MACHINE | MAY},
    {WIRE_HOME, ANY, WIRE_HOME_SIZE, MACHINE | MAY},
    {WIRE_RESUME, ANY, 0, MACHINE | MAY},
    {WIRE_HOLD, ANY, 0, MACHINE},
    {WIRE_JOG_STOP, ANY, WIRE_JOG_STOP_SIZE, 0}, /* hosts register and find devices with it */
    {WIRE_ESTOP, ANY, 0, 0},
    {WIRE_RESET, ANY, 0, MAY},
    {WIRE_IO_CONTROL, ANY, WIRE_IO_CONTROL_SIZE, MAY},
    {WIRE_CHANNEL_OUTPUTS, ANY, WIRE_CHANNEL_OUTPUTS_SIZE, MODULE | MAY},
    {WIRE_HANDSHAKE, TCP, WIRE_HANDSHAKE_SIZE, 0},
    {WIRE_PING, TCP, WIRE_PING_SIZE, 0},
    {WIRE_CONFIG_GET, TCP, WIRE_CONFIG_GET_SIZE, 0},
    {WIRE_CONFIG_SET, TCP, WIRE_CONFIG_SET_SIZE, MAY},
    {WIRE_CONFIG_SAVE, TCP, 0, MAY},
    {WIRE_STREAM_OPEN, TCP, WIRE_STREAM_OPEN_SIZE, MACHINE | MAY},
    {WIRE_STREAM_CLOSE, TCP, WIRE_STREAM_CLOSE_SIZE, MACHINE},
    {WIRE_STATISTICS, TCP, 0, 0},
    {WIRE_PROBE_LAST, TCP, 0, MACHINE},
    {WIRE_CHALLENGE, TCP, 0, 0},
    {WIRE_AUTHENTICATE, TCP, WIRE_AUTHENTICATE_SIZE, 0},
};

/* Datagrams are those of an authenticated connection's host. */
static bool has_authenticated(const struct session *session, const uint8_t address[4]) {
    for (unsigned i = 0; i < SESSION_CLIENTS; i++) {
        const struct session_client *client = &session->client[i];
        if (client->used && client->authenticated && session_same(client->address, address))
            return true;
    }
    return false;
}

static enum wire_refusal check(const struct session *session, const struct wire_header *header,
                               unsigned channel, bool authenticated, const uint8_t address[4]) {
    const struct session_owner *owner = &session->owner;
    const struct rule *rule = NULL;
    for (size_t i = 0; i < sizeof rules / sizeof rules[0] && rule == NULL; i++)
        if (rules[i].type == header->type && (rules[i].channels & channel) != 0)
            rule = &rules[i];
    if (rule == NULL || ((rule->needs & MODULE) != 0 && !session_is_module(session)))
        return WIRE_REFUSAL_UNKNOWN_TYPE;
    if (header->length < rule->least)
        return WIRE_REFUSAL_MALFORMED;
    if ((rule->needs & MACHINE) != 0 && session_is_module(session))
        return WIRE_REFUSAL_IO_MODULE;
    if ((rule->needs & MAY) == 0)
        return WIRE_REFUSAL_NONE;
    if (!authenticated && session->options.password[0] != '\0')
        return WIRE_REFUSAL_AUTHENTICATION;
    return owner->on && !session_same(owner->address, address) ? WIRE_REFUSAL_OWNER : WIRE_REFUSAL_NONE;
}

enum wire_refusal session_check_datagram(const struct session *session, const uint8_t address[4],
                                         const struct wire_header *header) {
    return check(session, header, UDP, has_authenticated(session, address), address);
}

enum wire_refusal session_check_request(const struct session *session, const struct session_client *client,
                                        const struct wire_header *header) {
    return check(session, header, TCP, client->authenticated, client->address);
}
