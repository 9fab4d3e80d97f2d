/* SPDX-License-Identifier: MIT
 * A hub with an owner, a pendant and an observer. */
#ifndef WIFICNC_TESTS_ESP32_HUB_PENDANTS_H
#define WIFICNC_TESTS_ESP32_HUB_PENDANTS_H

#include "hub_wires.h"

enum { OWNER, PENDANT, WATCHER };

static inline void come_as_pendant(unsigned n, enum net_pendant kind) {
    static const struct net_stream_ops ops = {.read = wire_read, .write = wire_write, .close = wire_close};
    const struct net_stream stream = {.ops = &ops, .ctx = &wires[n], .local = true, .pendant = (uint8_t)kind};
    memset(&wires[n], 0, sizeof wires[n]);
    CHECK(net_hub_connect(&hub, &stream, "pendant"));
}

static inline void fresh_lines(void) {
    got_count = 0;
    got[0] = '\0';
}

static inline void begin_with(enum net_pendant kind) {
    start("");
    CHECK(come(OWNER, true));
    come_as_pendant(PENDANT, kind);
    CHECK(come(WATCHER, true));
    send(OWNER, "\n");
    strcpy(says, "ok\r\n");
    round_trip();
    CHECK(hub.owner == &hub.client[OWNER] && hub.inside == 0);
    fresh_lines();
    for (unsigned n = 0; n < 3; n++) {
        wires[n].out_count = 0;
        wires[n].out[0] = '\0';
    }
}

static inline void machine_says(const char *text) {
    strcpy(says, text);
    round_trip();
}

#endif
