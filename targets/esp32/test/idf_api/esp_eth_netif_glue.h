/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_eth_netif_glue.h, declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "esp_eth.h"

typedef struct esp_eth_netif_glue_t *esp_eth_netif_glue_handle_t;

esp_eth_netif_glue_handle_t esp_eth_new_netif_glue(esp_eth_handle_t driver);
