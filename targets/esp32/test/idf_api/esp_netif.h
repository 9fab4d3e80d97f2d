/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_netif.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "esp_err.h"
#include "esp_event.h"

#include <stdbool.h>

typedef struct esp_netif_obj esp_netif_t;

extern esp_event_base_t const IP_EVENT;
typedef enum { IP_EVENT_STA_GOT_IP, IP_EVENT_ETH_GOT_IP = 5, IP_EVENT_ETH_LOST_IP } ip_event_t;

typedef struct {
    uint32_t addr;
} esp_ip4_addr_t;

typedef struct {
    esp_ip4_addr_t ip, netmask, gw;
} esp_netif_ip_info_t;

typedef struct {
    esp_netif_t *esp_netif;
    esp_netif_ip_info_t ip_info;
    bool ip_changed;
} ip_event_got_ip_t;

typedef struct {
    const void *base, *driver, *stack;
} esp_netif_config_t;

#define ESP_NETIF_DEFAULT_ETH() {.base = 0}

esp_err_t esp_netif_init(void);
esp_netif_t *esp_netif_get_handle_from_ifkey(const char *key);
esp_err_t esp_netif_dhcpc_start(esp_netif_t *netif);
esp_err_t esp_netif_dhcpc_stop(esp_netif_t *netif);
esp_err_t esp_netif_set_ip_info(esp_netif_t *netif, const esp_netif_ip_info_t *info);
esp_netif_t *esp_netif_new(const esp_netif_config_t *config);
esp_err_t esp_netif_attach(esp_netif_t *netif, void *driver);
esp_err_t esp_netif_set_hostname(esp_netif_t *netif, const char *name);
