/* SPDX-License-Identifier: MIT
 * WiFi: the stored network, and one of our own where none exists. [task, core 0]
 *
 * No password is ever printed, but that of our own network on the serial ports. */
#ifndef WIFICNC_ESP32_WIFI_H
#define WIFICNC_ESP32_WIFI_H

#include "store/nvs_names.h"
#include "store/nvs_store.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** What came in. */
enum wifi_news { WIFI_NEWS_ADDRESS, WIFI_NEWS_LOST };

/** [start, behind esp_netif_init()] The driver, with the stored network. The radio is off. @param name  of
 * our own network, and of this controller in others @return false: it did not start */
bool wifi_init(const struct nvs_store *store, const char *name);

/** Password of our own network: stored, or made now; empty before wifi_init(). */
const char *wifi_own_password(void);

/** A network that the radio hears. */
struct wifi_network {
    char name[WIFI_SSID_MAX + 1];
    int8_t rssi_dbm;
    bool secured;
};

enum { WIFI_NETWORKS = 16 };

/** [the network task] Search for networks; WIFI_EVENT_SCAN_DONE says when it has. @return false: not now */
bool wifi_scan(void);

/** [the network task, behind that event] @param[out] found  the strongest first, each name once @return how
 * many */
size_t wifi_scanned(struct wifi_network found[WIFI_NETWORKS]);

/** Every 100 ms. @param on  whether WiFi is to be on @return our own network is up */
bool wifi_poll(bool on);

/** [the network task] Another network was stored: leave the one before, try the new one immediately. */
void wifi_join_stored(const struct nvs_store *store);

/** [the network task] A network is on trial: an own network that is up stays. */
void wifi_hold_own(bool hold);

/** [the network task] A network is stored. */
bool wifi_has_network(void);

/** [the network task] News of the driver's events. */
void wifi_news(enum wifi_news news);

#endif
