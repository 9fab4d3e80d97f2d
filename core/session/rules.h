/* SPDX-License-Identifier: MIT
 * What a packet of a host needs before anything looks into it: a row for each, from protocol/wmc3.toml. */
#ifndef WIFICNC_SESSION_RULES_H
#define WIFICNC_SESSION_RULES_H

#include "session/session.h"

#include <stddef.h>

/** Bits of session_rule.channels. */
enum { CHANNEL_UDP = 1, CHANNEL_TCP = 2 };

/** Bits of session_rule.needs. */
enum {
    NEEDS_MACHINE = 1, /* what an I/O module has not */
    NEEDS_MODULE = 2,  /* what only an I/O module has */
    NEEDS_MAY = 4,     /* authenticated, and no other host commands */
    NEEDS_LOGIN = 8,   /* authenticated, whoever commands */
};

/** The newest order of each kind is remembered. A packet that was sent before it and arrives after it was
 * overtaken on its way, or is a duplicate, and must not move or switch anything any more. */
struct session_rule {
    uint8_t type; /* enum wire_type */
    uint8_t channels;
    uint8_t least; /* payload, bytes */
    uint8_t needs;
    uint8_t is;    /* which order it is: bits 1 << SESSION_ORDER_ */
    uint8_t after; /* not when one of these has overtaken it */
};

extern const struct session_rule session_rules[];
extern const size_t session_rule_count;

#endif
