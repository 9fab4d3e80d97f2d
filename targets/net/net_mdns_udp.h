/* SPDX-License-Identifier: MIT
 * The socket of multicast DNS. Nothing blocks. */
#ifndef WIFICNC_NET_MDNS_UDP_H
#define WIFICNC_NET_MDNS_UDP_H

#include "net_mdns.h"

/** @param host  numeric; "0.0.0.0" outside of tests  @param port  NET_MDNS_PORT outside of tests
 *  @return the socket; -1: it could not be opened */
int net_mdns_open(const char *host, uint16_t port);

/** Join the group with the interface of mdns->address, and announce ourselves: at every new address. */
void net_mdns_join(int fd, const struct net_mdns *mdns);

/** Announce that we end, where net_mdns_join() was. */
void net_mdns_leave(int fd, const struct net_mdns *mdns);

/** Answer what has come, NET_MDNS_ANSWERS times a second at most. */
void net_mdns_poll(int fd, struct net_mdns *mdns, uint32_t now_us);

#endif
