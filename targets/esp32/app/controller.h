/* SPDX-License-Identifier: MIT
 * The controller task: the machine, and all its clients behind one hub. [task, core 0] Plain C and BSD
 * sockets: it runs on a computer, too, and is tested there.
 *
 * One loop does it all, so nothing here needs a lock: bytes in, machine_poll(), answers out. It never blocks.
 */
#ifndef WIFICNC_ESP32_CONTROLLER_H
#define WIFICNC_ESP32_CONTROLLER_H

#include "machine/machine.h"
#include "net_hub.h"
#include "net_wire.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { CONTROLLER_PORTS = 3, CONTROLLER_SAID = 256 };

/** A serial port: a client that is always there. When the hub lets it go (it was too slow), it comes back. */
struct controller_port {
    struct net_stream stream; /* .ops NULL: there is no such port */
    const char *name;
    bool attached; /* a client of the hub now */
};

/** Chosen at start, from the storage. */
struct controller_options {
    const char *key; /* access key, told at serial ports; outlives this */
    /** The address of the page; as net_hub_ops.page, without a context. NULL: there is none */
    bool (*page)(char *text, size_t size);
};

struct controller {
    struct machine *machine;
    struct net_hub hub;
    struct access access; /* set up by the target, before clients come */
    const char *key;
    bool (*page)(char *text, size_t size);
    struct controller_port port[CONTROLLER_PORTS];
    int listener;  /* -1: no network yet */
    bool has_wire; /* hosts of the binary protocol are served */
    struct session session;
    struct net_wire wire;
    uint32_t asked_us;          /* when observers' status requests were last passed on */
    char said[CONTROLLER_SAID]; /* by the machine, not yet heard by the hub */
    size_t said_count;
};

/** No client, no listener. @param machine  set up later, by machine_init() with controller_out() */
void controller_init(struct controller *controller, struct machine *machine,
                     const struct net_hub_sizes *sizes);

/** [start, before controller_listen()] */
void controller_set(struct controller *controller, const struct controller_options *options);

/** Where the machine's answers go. */
struct text_out controller_out(struct controller *controller);

/** Add a serial port. @param name  outlives this */
void controller_add_port(struct controller *controller, const struct net_stream *stream, const char *name);

/** Listen for telnet and raw TCP. @return false: *error is an errno */
bool controller_listen(struct controller *controller, const char *host, const char *port, int *error);

/** Serve hosts of the binary protocol on all networks. @param ops  send is net_wire_send; its ctx is given
 * here
 *  @return false: *error is an errno */
bool controller_serve_wire(struct controller *controller, const struct session_options *options,
                           const struct session_ops *ops, int *error);

/** What a restart would end. @return NULL: nothing; else the reason, and what to do */
const char *controller_why_busy(const struct controller *controller);

/** Someone who may command is connected over the network. */
bool controller_is_reached(const struct controller *controller);

/** One round. @return true: there is more to do immediately; false: nothing for a ms */
bool controller_round(struct controller *controller);

#endif
