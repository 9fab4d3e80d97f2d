/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_netif.h, declared anew: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "esp_err.h"
#include "esp_event.h"

typedef struct esp_netif_obj esp_netif_t;

extern esp_event_base_t const IP_EVENT;
typedef enum { IP_EVENT_STA_GOT_IP } ip_event_t;

esp_err_t esp_netif_init(void);
