/* SPDX-License-Identifier: MIT
 * Ethernet or WiFi, whichever serves, in one task. [core 0] Losing any of them touches nothing but its
 * connections: motion runs on the other core, from its ring. */
#ifndef WIFICNC_ESP32_NETWORK_H
#define WIFICNC_ESP32_NETWORK_H

#include "net/wifi.h"
#include "net/wifi_policy.h"
#include "store/nvs_store.h"

#include <stdbool.h>
#include <stdint.h>

/** Our address in our own network, ESP-IDF's default. */
#define NETWORK_OWN_TEXT "192.168.4.1"

/** [start] @return false: neither started; the serial ports continue working */
bool network_start(const struct nvs_store *store);

/** As stored, else "WiFiCNC-1A2B", the end of the chip's own MAC address. Empty before network_start(). */
const char *network_name(void);

/** [any task] A network was stored: join it, now. */
void network_join_stored(void);

/** [any task] Search for networks. @return false: one looks already, or there is no WiFi */
bool network_scan(void);

/** [any task, one at a time] What the last look has found. @param index  0 is the strongest
 *  @param[out] found  of NETWORK_FOUND */
enum network_scan { NETWORK_SCANNING, NETWORK_FOUND, NETWORK_NO_MORE };
enum network_scan network_scanned(size_t index, struct wifi_network *found);

/** [any task] Our address in the stored WiFi network, network order; 0: not connected. */
uint32_t network_station_address(void);

/** [any task] How it is with the stored WiFi network. */
enum wifi_state network_state(void);

/** [any task] A network is on trial: an own network that is up stays, so that a phone in it sees how it went.
 */
void network_hold_own(bool hold);

/** [any task] Our own network is up. */
bool network_own_is_up(void);

/** [any task] A connection came through our own network. By both of its ends: a computer of another network
 * can send to our address there, but gets no answer with an address of it. @param here, peer  IPv4,
 * lockout_ipv4() */
bool network_is_own(uint64_t here, uint64_t peer);

/** [any task] Our address, network order: Ethernet's, else WiFi's, else that of our own network; 0: none. */
uint32_t network_address(void);

#endif
