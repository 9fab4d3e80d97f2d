/* SPDX-License-Identifier: MIT
 * What a packet of a host needs before anything looks into it: its channel, its length, a machine or a module
 * behind this device, that this host may command, and that nothing has overtaken it. */
#include "session/rules.h"
#include "session/inner.h"

#include <string.h>

#define OVERTAKEN_US 10000000 /* by its sender's clock; what is older is of another program */

static const struct session_rule *rule_of(uint8_t type, unsigned channel) {
    for (size_t i = 0; i < session_rule_count; i++)
        if (session_rules[i].type == type && (session_rules[i].channels & channel) != 0)
            return &session_rules[i];
    return NULL;
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

static bool is_overtaken(const struct session *session, const struct session_rule *rule,
                         const struct wire_header *header, const uint8_t address[4]) {
    for (unsigned n = 0; n < SESSION_ORDERS; n++)
        if ((rule->after >> n & 1) != 0 && is_before(header, address, &session->order[n]))
            return true;
    return false;
}

static void note_order(struct session *session, const struct session_rule *rule,
                       const struct wire_header *header, const uint8_t address[4]) {
    for (unsigned n = 0; n < SESSION_ORDERS; n++) {
        struct session_order *order = &session->order[n];
        if ((rule->is >> n & 1) == 0 || is_before(header, address, order))
            continue;
        *order = (struct session_order){.sequence = header->sequence, .timestamp_us = header->timestamp_us};
        memcpy(order->address, address, sizeof order->address);
    }
}

static enum wire_refusal check(struct session *session, const struct wire_header *header, unsigned channel,
                               bool proven, const uint8_t address[4]) {
    const struct session_owner *owner = &session->owner;
    const struct session_rule *rule = rule_of(header->type, channel);
    /* In this order: the packet exists, is complete, and is for this kind of device; then who sends it;
     * then when. note_order() comes last, so that an order that is refused overtakes nothing. */
    if (rule == NULL || ((rule->needs & NEEDS_MODULE) != 0 && !session_is_module(session)))
        return WIRE_REFUSAL_UNKNOWN_TYPE;
    if (header->length < rule->least)
        return WIRE_REFUSAL_MALFORMED;
    if ((rule->needs & NEEDS_MACHINE) != 0 && session_is_module(session))
        return WIRE_REFUSAL_IO_MODULE;
    bool locked = !proven && !access_may(session->options.access, lockout_ipv4(address));
    if ((rule->needs & (NEEDS_MAY | NEEDS_LOGIN)) != 0 && locked)
        return WIRE_REFUSAL_AUTHENTICATION;
    if ((rule->needs & NEEDS_MAY) != 0 && owner->on && !session_same(owner->address, address))
        return WIRE_REFUSAL_OWNER;
    if (is_overtaken(session, rule, header, address))
        return WIRE_REFUSAL_OVERTAKEN;
    /* An address that anyone can forge: what a stranger stops is stopped, but it overtakes nothing. */
    if (!locked)
        note_order(session, rule, header, address);
    return WIRE_REFUSAL_NONE;
}

enum wire_refusal session_check_datagram(struct session *session, const uint8_t address[4],
                                         const struct wire_header *header, bool sealed) {
    return check(session, header, CHANNEL_UDP, sealed, address);
}

enum wire_refusal session_check_request(struct session *session, const struct session_client *client,
                                        const struct wire_header *header) {
    return check(session, header, CHANNEL_TCP, client->authenticated, client->address);
}

enum wire_refusal session_refusal(enum refusal refusal) {
    static const uint8_t packets[REFUSAL_COUNT] = {
#define REFUSAL(name, error, packet) [REFUSAL_##name] = WIRE_REFUSAL_##packet,
#include "machine/refusals.def"
#undef REFUSAL
    };
    return (enum wire_refusal)packets[refusal];
}
