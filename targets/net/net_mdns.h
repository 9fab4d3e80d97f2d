/* SPDX-License-Identifier: MIT
 * Multicast DNS (RFC 6762, 6763): NAME.local, and the services of this controller: telnet, and the web page.
 * [task] Packets only; net_mdns_udp.h has the socket.
 *
 *   NAME.local                      A     our address
 *   _telnet._tcp.local              PTR   NAME._telnet._tcp.local
 *   NAME._telnet._tcp.local         SRV   NAME.local, port;  TXT  wificnc=BOARD
 *   _http._tcp.local                PTR   NAME._http._tcp.local
 *   NAME._http._tcp.local           SRV   NAME.local, port;  TXT  path=/ board=BOARD id=ID
 *   _services._dns-sd._udp.local    PTR   each service */
#ifndef WIFICNC_NET_MDNS_H
#define WIFICNC_NET_MDNS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    NET_MDNS_PORT = 5353,
    NET_MDNS_PACKET = 960,
    NET_MDNS_QUERY = 768,
    NET_MDNS_NAME = 32,
    NET_MDNS_BOARD = 64
};
/** Answers in a second. They are larger than questions, and a question can have a forged address. */
enum { NET_MDNS_ANSWERS = 10 };

/** Who we are. */
struct net_mdns {
    char name[NET_MDNS_NAME];
    char id[NET_MDNS_NAME];     /* of the hardware: it stays when the name is changed */
    char board[NET_MDNS_BOARD]; /* "esp32s3-devkitc" */
    uint8_t address[4];         /* 0.0.0.0: we have none, and are silent */
    uint16_t telnet_port;       /* 0: this service does not exist and is not announced */
    uint16_t http_port;         /* the same */
    uint16_t answers;           /* in the second that began at: */
    uint32_t second_us;
};

/** The answer to a packet. @param legacy  it comes from another port than 5353: a simple resolver
 *  @param[out] unicast  the answer goes to the one who asked, else to all
 *  @return bytes of it; 0: nothing in it is about us, or it is damaged */
size_t net_mdns_answer(const struct net_mdns *mdns, const uint8_t *query, size_t size, bool legacy,
                       uint8_t answer[NET_MDNS_PACKET], bool *unicast);

/** Whether one more answer may be sent now. */
bool net_mdns_may_answer(struct net_mdns *mdns, uint32_t now_us);

/** All records, for everyone. @param leaves  caches must drop them (RFC 6762, 10.1)
 *  @return bytes; 0: we have no address */
size_t net_mdns_announce(const struct net_mdns *mdns, bool leaves, uint8_t packet[NET_MDNS_PACKET]);

#endif
