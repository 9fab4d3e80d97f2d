/* SPDX-License-Identifier: MIT
 * What the status light of a board shows. [task] Pure: no clock, no pin. The table is net_light.def. */
#ifndef WIFICNC_NET_LIGHT_H
#define WIFICNC_NET_LIGHT_H

#include <stdbool.h>
#include <stdint.h>

enum { NET_LIGHT_LEVEL = 20 }; /* of 255: it must not dazzle */

enum net_light {
#define LIGHT(name, colour, on_ms, off_ms, plain_on_ms, plain_off_ms, text) NET_LIGHT_##name,
#include "net_light.def"
#undef LIGHT
    NET_LIGHT_COUNT
};

/** What it is made of. */
struct net_light_facts {
    bool alarm;
    bool at_rest;
    bool controlled; /* by a client, or a host of the binary protocol */
    bool joined;     /* it has an address in a network that is not its own */
    bool joining;
    bool own; /* its own network is up */
};

struct net_light_colour {
    uint8_t red, green, blue;
};

enum net_light net_light_of(const struct net_light_facts *facts);

/** As in the table, such as "JOINED". */
const char *net_light_name(enum net_light light);

/** @param now_ms  wraps */
struct net_light_colour net_light_colour(enum net_light light, uint32_t now_ms);

/** Of an LED with one colour. */
bool net_light_is_on(enum net_light light, uint32_t now_ms);

#endif
