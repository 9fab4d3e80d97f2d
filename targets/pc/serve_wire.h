/* SPDX-License-Identifier: MIT
 * The binary protocol of the serving controller: a session and its sockets. One thread, as the server. */
#ifndef WIFICNC_PC_SERVE_WIRE_H
#define WIFICNC_PC_SERVE_WIRE_H

#include "host_device.h"
#include "host_module.h"
#include "net_wire.h"
#include "port.h"

struct host;

enum { SERVE_WIRE_POLLS = 2 + SESSION_CLIENTS };

struct serve_wire {
    bool open, is_module;
    struct host_module module;
    struct host_device device;
    struct session session;
    struct net_wire net;
};

/** Read what is stored of the I/O module. @param force  be one whatever is stored @return it is one */
bool serve_wire_choose(struct serve_wire *wire, struct host *host, bool force);

/** @param access  lives as long as this @return 0 or an error of the system */
int serve_wire_open(struct serve_wire *wire, struct host *host, const char *address, struct access *access);
void serve_wire_close(struct serve_wire *wire);

/** What to wait for. */
void serve_wire_fill_poll(const struct serve_wire *wire, struct port_poll polls[SERVE_WIRE_POLLS]);

/** Do what has come. */
void serve_wire_read(struct serve_wire *wire);

/** After the controller has worked. */
void serve_wire_poll(struct serve_wire *wire);

/** Wait for at most this long, virtual us; UINT32_MAX: no need to come back. */
uint32_t serve_wire_wait_us(const struct serve_wire *wire);

#endif
