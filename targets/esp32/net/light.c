/* SPDX-License-Identifier: MIT */
#include "net/light.h"

#include "net/network.h"

void light_add_network(struct net_light_facts *facts) {
    facts->own = network_own_is_up();
    facts->joining = network_state() == WIFI_JOINING;
    /* Without WiFi's and its own network's an address is Ethernet's. */
    facts->joined = network_station_address() != 0 || (network_address() != 0 && !facts->own);
}
