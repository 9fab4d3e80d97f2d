/* SPDX-License-Identifier: MIT
 * Telnet negotiation (RFC 854) taken out of a byte stream. Every offer is refused: the answer to WILL is
 * DONT, to DO it is WONT, to anything else there is none; so no negotiation loops. A sender that never sends
 * 0xFF sees nothing of it. */
#ifndef WIFICNC_NET_TELNET_H
#define WIFICNC_NET_TELNET_H

#include <stddef.h>
#include <stdint.h>

/** All zero is a stream's begin. */
struct net_telnet {
    uint8_t state, verb;
};

enum { NET_TELNET_REPLY = 3 };

/** One byte. @param reply  what must be sent back, if *reply_count is set to NET_TELNET_REPLY and not 0
 *  @return 1: the byte is data; 0: it was telnet's */
int net_telnet_take(struct net_telnet *telnet, uint8_t byte, char reply[NET_TELNET_REPLY],
                    size_t *reply_count);

#endif
