/* SPDX-License-Identifier: MIT
 * WiFi: the stored network, and one of our own where there is none. [task, core 0]
 *
 * NVS keys: wifi_ssid, wifi_pass (the stored network), ap_pass (of our own network; random, made at the first
 * start). No password is ever printed, but that of our own network on the serial ports. */
#ifndef WIFICNC_ESP32_WIFI_H
#define WIFICNC_ESP32_WIFI_H

#include "store/nvs_store.h"

#include <stdbool.h>

enum { WIFI_SSID_SIZE = 33, WIFI_PASSWORD_SIZE = 64, WIFI_ADDRESS_SIZE = 16 };

/** [start] Radio and its task. @return false: it did not start; the serial ports go on working */
bool wifi_start(const struct nvs_store *store);

/** Name and password of our own network; empty before wifi_start(). */
const char *wifi_own_name(void);
const char *wifi_own_password(void);

#endif
