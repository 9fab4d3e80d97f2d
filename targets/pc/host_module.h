/* SPDX-License-Identifier: MIT
 * The host controller as an I/O module: 64 virtual pins for its channels, of which the last four are inputs
 * only, and a store. Every host controller has one, because a host program may configure it before the
 * restart that makes it one. One thread, as the host. */
#ifndef WIFICNC_PC_HOST_MODULE_H
#define WIFICNC_PC_HOST_MODULE_H

#include "session/session.h"

struct host;

enum { MODULE_PINS = 64, MODULE_INPUT_PINS = 60 }; /* from this one on: no outputs */

/** What holds a line from outside. */
enum module_hold { MODULE_OPEN, MODULE_LOW, MODULE_HIGH };

struct host_module {
    struct channels channels;
    struct session_module device;
    struct channels_wiring wiring;
    uint8_t hold[MODULE_PINS]; /* enum module_hold */
    uint64_t driven, level;    /* of the pins that are outputs */
    bool blank;                /* nothing was stored */
};

/** What is stored, or the defaults. Nothing is wired yet. The host lives longer. */
void host_module_init(struct host_module *module, struct host *host);

/** Be a module: wire the channels. Without anything stored there are 16 inputs, on pins 0 .. 15. */
void host_module_start(struct host_module *module);

/** Hold a pin from outside. @return false: no such pin */
bool host_module_hold(struct host_module *module, unsigned pin, enum module_hold hold);

/** A line for the hands at the machine: `pin N high|low|open`, or `pins`. @param[out] answer  one line with
 * its end @return false: it is none of these */
bool host_module_line(struct host_module *module, const char *line, char *answer, size_t size);

#endif
