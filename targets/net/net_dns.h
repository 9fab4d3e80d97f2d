/* SPDX-License-Identifier: MIT
 * The name server of the controller's own network: every name leads to the controller (RFC 1035), so that a
 * phone that looks for the internet finds the page. [task] */
#ifndef WIFICNC_NET_DNS_H
#define WIFICNC_NET_DNS_H

#include <stdint.h>

enum { NET_DNS_PORT = 53 };

/** @param host  numeric: of the own network, so that no other network is answered
 *  @return the socket; -1: it could not be opened */
int net_dns_open(const char *host, uint16_t port);

/** Answer what has come. @param address  where every name leads */
void net_dns_poll(int fd, const uint8_t address[4]);

#endif
