/* SPDX-License-Identifier: MIT
 * An I/O module: its channels as pins. No socket, no HAL, no clock, as in link.h. */
#ifndef WIFICNC_LINUXCNC_MODULE_H
#define WIFICNC_LINUXCNC_MODULE_H

#include "peer.h"
#include "pins.h"

enum { MODULE_CHANNELS = 16 };

struct module_pins {
    pin_BIT in[MODULE_CHANNELS], in_not[MODULE_CHANNELS]; /* inputs that are on, and those that are not */
    pin_BIT out[MODULE_CHANNELS];
    pin_BIT estop, reset; /* as those of a controller */
    pin_BIT connected, estop_ok, estopped, fault;
};

struct module {
    struct peer peer;
    struct module_pins *pins;
    uint16_t outputs; /* mask of the channels that may be switched */
    unsigned asks;    /* questions about the channels that are not answered */
    uint16_t said;    /* as last told */
    bool is_said;     /* it was sent, and not refused */
    bool is_asked;    /* that is not answered */
    double said_s;
    uint8_t refusal; /* of what was sent to it last */
};

/** Make all pins. @return 0, or the first answer of `make` that was not */
int module_make_pins(struct module_pins *pins, pin_maker make, void *ctx);
/** A TCP connection is there. What comes is given to module->peer. @param key  of access; "": none */
void module_begin(struct module *module, struct module_pins *pins, const struct peer_world *world,
                  const char *key, double now_s);
/** Every 10 ms. @return why the module is gone, NULL: it is not */
const char *module_tick(struct module *module, double now_s);
/** It is gone: pins say so; inputs stay as they were known last. */
void module_lose(struct module_pins *pins);

#endif
