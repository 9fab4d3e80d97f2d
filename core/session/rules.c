/* SPDX-License-Identifier: MIT
 * What a packet of a host needs before anything looks into it: its channel, its length, a machine or a module
 * behind this device, that this host may command, and that nothing has overtaken it. */
#include "session/inner.h"

#include <stddef.h>
#include <string.h>

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

/* Of these the newest of a host is remembered: what was sent before some of them and comes behind has been
 * overtaken on its way, or doubled, and must not move or switch anything any more. */
enum {
    JOG = 1 << SESSION_ORDER_JOG,
    JOG_STOP = 1 << SESSION_ORDER_JOG_STOP,
    HOLD = 1 << SESSION_ORDER_HOLD,
    ESTOP = 1 << SESSION_ORDER_ESTOP,
    OUTPUTS = 1 << SESSION_ORDER_OUTPUTS,
};

#define OVERTAKEN_US 10000000 /* by its sender's clock; what is older is of another program */

struct rule {
    uint8_t type; /* enum wire_type */
    uint8_t channels;
    uint8_t least; /* payload, bytes */
    uint8_t needs;
    uint8_t is;    /* which order it is */
    uint8_t after; /* not when one of these has overtaken it */
};

static const struct rule rules[] = {
    {WIRE_MOTION, UDP, WIRE_MOTION_SIZE, MACHINE | MAY, 0, ESTOP},
    {WIRE_STREAM_SEGMENTS, UDP, WIRE_STREAM_SEGMENTS_SIZE, MACHINE | MAY, 0, 0},
    {WIRE_JOG, ANY, WIRE_JOG_SIZE, MACHINE | MAY, JOG, JOG | JOG_STOP | HOLD | ESTOP},
    {WIRE_HOME, ANY, WIRE_HOME_SIZE, MACHINE | MAY, 0, HOLD | ESTOP},
    {WIRE_RESUME, ANY, 0, MACHINE | MAY, 0, HOLD | ESTOP},
    {WIRE_HOLD, ANY, 0, MACHINE, HOLD, 0},
    {WIRE_JOG_STOP, ANY, WIRE_JOG_STOP_SIZE, 0, JOG_STOP, 0}, /* hosts register and find devices with it */
    {WIRE_ESTOP, ANY, 0, 0, ESTOP, 0},
    {WIRE_RESET, ANY, 0, MAY, 0, ESTOP},
    {WIRE_IO_CONTROL, ANY, WIRE_IO_CONTROL_SIZE, MAY, OUTPUTS, OUTPUTS | ESTOP},
    {WIRE_CHANNEL_OUTPUTS, ANY, WIRE_CHANNEL_OUTPUTS_SIZE, MODULE | MAY, 0, ESTOP},
    {WIRE_HANDSHAKE, TCP, WIRE_HANDSHAKE_SIZE, 0, 0, 0},
    {WIRE_PING, TCP, WIRE_PING_SIZE, 0, 0, 0},
    {WIRE_CONFIG_GET, TCP, WIRE_CONFIG_GET_SIZE, 0, 0, 0},
    {WIRE_CONFIG_SET, TCP, WIRE_CONFIG_SET_SIZE, MAY, 0, 0},
    {WIRE_CONFIG_SAVE, TCP, 0, MAY, 0, 0},
    {WIRE_STREAM_OPEN, TCP, WIRE_STREAM_OPEN_SIZE, MACHINE | MAY, 0, 0},
    {WIRE_STREAM_CLOSE, TCP, WIRE_STREAM_CLOSE_SIZE, MACHINE, 0, 0},
    {WIRE_STREAM_DROP, TCP, WIRE_STREAM_DROP_SIZE, MACHINE, 0, 0},
    {WIRE_STATISTICS, TCP, 0, 0, 0, 0},
    {WIRE_PROBE_LAST, TCP, 0, MACHINE, 0, 0},
    {WIRE_CHALLENGE, TCP, 0, 0, 0, 0},
    {WIRE_AUTHENTICATE, TCP, WIRE_AUTHENTICATE_SIZE, 0, 0, 0},
};

static const struct rule *rule_of(uint8_t type, unsigned channel) {
    for (size_t i = 0; i < sizeof rules / sizeof rules[0]; i++)
        if (rules[i].type == type && (rules[i].channels & channel) != 0)
            return &rules[i];
    return NULL;
}

/* Datagrams are those of an authenticated connection's host. */
static bool has_authenticated(const struct session *session, const uint8_t address[4]) {
    for (unsigned i = 0; i < SESSION_CLIENTS; i++) {
        const struct session_client *client = &session->client[i];
        if (client->used && client->authenticated && session_same(client->address, address))
            return true;
    }
    return false;
}

/* Sent before the order: its number and its time stamp say so. One of them alone may be that of a program
 * that counts from 0 or has no clock. */
static bool is_before(const struct wire_header *header, const uint8_t address[4],
                      const struct session_order *order) {
    int32_t ahead = (int32_t)(header->sequence - order->sequence);
    int32_t later_us = (int32_t)(header->timestamp_us - order->timestamp_us);
    return session_same(address, order->address) && ahead < 0 && ahead > -SEQUENCE_JUMP && later_us < 0 &&
           later_us > -OVERTAKEN_US;
}

static bool is_overtaken(const struct session *session, const struct rule *rule,
                         const struct wire_header *header, const uint8_t address[4]) {
    for (unsigned n = 0; n < SESSION_ORDERS; n++)
        if ((rule->after >> n & 1) != 0 && is_before(header, address, &session->order[n]))
            return true;
    return false;
}

static void note_order(struct session *session, const struct rule *rule, const struct wire_header *header,
                       const uint8_t address[4]) {
    for (unsigned n = 0; n < SESSION_ORDERS; n++) {
        struct session_order *order = &session->order[n];
        if ((rule->is >> n & 1) == 0 || is_before(header, address, order))
            continue;
        *order = (struct session_order){.sequence = header->sequence, .timestamp_us = header->timestamp_us};
        memcpy(order->address, address, sizeof order->address);
    }
}

static enum wire_refusal check(struct session *session, const struct wire_header *header, unsigned channel,
                               bool authenticated, const uint8_t address[4]) {
    const struct session_owner *owner = &session->owner;
    const struct rule *rule = rule_of(header->type, channel);
    if (rule == NULL || ((rule->needs & MODULE) != 0 && !session_is_module(session)))
        return WIRE_REFUSAL_UNKNOWN_TYPE;
    if (header->length < rule->least)
        return WIRE_REFUSAL_MALFORMED;
    if ((rule->needs & MACHINE) != 0 && session_is_module(session))
        return WIRE_REFUSAL_IO_MODULE;
    bool locked = !authenticated && session->options.password[0] != '\0';
    if ((rule->needs & MAY) != 0 && locked)
        return WIRE_REFUSAL_AUTHENTICATION;
    if ((rule->needs & MAY) != 0 && owner->on && !session_same(owner->address, address))
        return WIRE_REFUSAL_OWNER;
    if (is_overtaken(session, rule, header, address))
        return WIRE_REFUSAL_OVERTAKEN;
    note_order(session, rule, header, address);
    return WIRE_REFUSAL_NONE;
}

enum wire_refusal session_check_datagram(struct session *session, const uint8_t address[4],
                                         const struct wire_header *header) {
    return check(session, header, UDP, has_authenticated(session, address), address);
}

enum wire_refusal session_check_request(struct session *session, const struct session_client *client,
                                        const struct wire_header *header) {
    return check(session, header, TCP, client->authenticated, client->address);
}

enum wire_refusal session_refusal(enum refusal refusal) {
    static const uint8_t packets[REFUSAL_COUNT] = {
#define REFUSAL(name, error, packet) [REFUSAL_##name] = WIRE_REFUSAL_##packet,
#include "machine/refusals.def"
#undef REFUSAL
    };
    return (enum wire_refusal)packets[refusal];
}
