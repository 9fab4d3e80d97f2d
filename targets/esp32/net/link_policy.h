/* SPDX-License-Identifier: MIT
 * Ethernet or WiFi. [task] Pure.
 *
 *   the cable has had an address for 5 s            -> WiFi goes off, all runs over Ethernet
 *   no Ethernet address 5 s after the start         -> WiFi comes on
 *   the address or the cable has been gone for 5 s  -> WiFi comes on again
 *
 * WiFi and Ethernet overlap for these seconds, so that no connection is cut that could be moved. */
#ifndef WIFICNC_ESP32_LINK_POLICY_H
#define WIFICNC_ESP32_LINK_POLICY_H

#include <stdbool.h>
#include <stdint.h>

enum { LINK_SETTLES_MS = 5000 };

struct link_policy {
    bool ethernet; /* there is a cable with an address */
    bool wifi;     /* WiFi is to be on */
    uint32_t since_ms;
};

/** @param has_ethernet  a W5500 answers; without one WiFi is on immediately */
void link_policy_init(struct link_policy *policy, bool has_ethernet, uint32_t now_ms);

/** Ethernet has got an address, or has lost it. */
void link_policy_ethernet(struct link_policy *policy, bool up, uint32_t now_ms);

/** Ask every 100 ms or so. @return whether WiFi is to be on */
bool link_policy_wifi(struct link_policy *policy, uint32_t now_ms);

#endif
