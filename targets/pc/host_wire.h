/* SPDX-License-Identifier: MIT
 * [tests] WMC3 of a host controller in virtual time, without sockets: the caller is the network. serve_wire.h
 * is the same with sockets and the wall clock. One thread, as the host. */
#ifndef WIFICNC_PC_HOST_WIRE_H
#define WIFICNC_PC_HOST_WIRE_H

#include "host.h"

struct host_wire;

/** A motion controller, or an I/O module where the host's store says so.
 * @param key  of access; "": open @return NULL: no memory. The host must live longer. */
struct host_wire *host_wire_create(struct host *host, const char *key);
void host_wire_destroy(struct host_wire *wire);

/** How often the simulated network was taken into use after a change. */
unsigned host_wire_joined(const struct host_wire *wire);

/** Someone at this address has logged in and said that it is to be trusted. @param span  enum access_span */
void host_wire_trust(struct host_wire *wire, uint32_t address, int span);

/** As host_wire_create(), but an I/O module, whatever the store says. */
struct host_wire *host_wire_create_module(struct host *host, const char *key);

/** Hold a pin of the I/O module from outside (host_module.h). @return false: no such pin */
bool host_wire_hold(struct host_wire *wire, unsigned pin, int hold);

/** Levels of the module's outputs, and which pins are outputs. */
uint64_t host_wire_levels(const struct host_wire *wire, uint64_t *driven);

/** A datagram has come. @param address  a.b.c.d as a<<24 | b<<16 | c<<8 | d */
void host_wire_datagram(struct host_wire *wire, uint32_t address, uint16_t port, const uint8_t *bytes,
                        size_t size);

/** A datagram to there was answered by ICMP: it cannot be reached (session_unreachable()). */
void host_wire_unreachable(struct host_wire *wire, uint32_t address, uint16_t port);

/** The oldest datagram that was sent. @return its size, 0: none. What is not taken is kept. */
size_t host_wire_sent(struct host_wire *wire, uint32_t *address, uint16_t *port, uint8_t *bytes, size_t size);

/** A TCP client. @return its number, -1: all places are taken */
int host_wire_connect(struct host_wire *wire, uint32_t address);
void host_wire_disconnect(struct host_wire *wire, int client);

/** A message and its reply. @param reply  room for 512 bytes @return size of the reply, 0: none, or
 *  a proof waits for its turn (session_must_wait()): send it again later */
size_t host_wire_request(struct host_wire *wire, int client, const uint8_t *message, size_t size,
                         uint8_t *reply);

/** Let the controller work until this virtual time; hosts are served every ms. */
void host_wire_run(struct host_wire *wire, uint64_t t_ticks);

#endif
