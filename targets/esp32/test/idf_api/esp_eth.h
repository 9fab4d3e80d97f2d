/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_eth.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "esp_err.h"
#include "esp_event.h"

typedef void *esp_eth_handle_t;
typedef struct esp_eth_mac_s esp_eth_mac_t;
typedef struct esp_eth_phy_s esp_eth_phy_t;

extern esp_event_base_t const ETH_EVENT;
typedef enum { ETHERNET_EVENT_DISCONNECTED = 3 } eth_event_t;
typedef enum { ETH_CMD_G_MAC_ADDR, ETH_CMD_S_MAC_ADDR } esp_eth_io_cmd_t;

typedef struct {
    uint32_t flags;
} eth_mac_config_t;

typedef struct {
    int reset_gpio_num;
} eth_phy_config_t;

typedef struct {
    esp_eth_mac_t *mac;
    esp_eth_phy_t *phy;
} esp_eth_config_t;

#define ETH_MAC_FLAG_PIN_TO_CORE       2
#define ETH_MAC_DEFAULT_CONFIG()       {.flags = 0}
#define ETH_PHY_DEFAULT_CONFIG()       {.reset_gpio_num = 5}
#define ETH_DEFAULT_CONFIG(emac, ephy) {.mac = emac, .phy = ephy}

esp_eth_phy_t *esp_eth_phy_new_w5500(const eth_phy_config_t *config);
esp_err_t esp_eth_driver_install(const esp_eth_config_t *config, esp_eth_handle_t *driver);
esp_err_t esp_eth_start(esp_eth_handle_t driver);
esp_err_t esp_eth_ioctl(esp_eth_handle_t driver, esp_eth_io_cmd_t command, void *data);
