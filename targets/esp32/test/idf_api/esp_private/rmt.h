/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_private/rmt.h, declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "driver/rmt_tx.h"

esp_err_t rmt_get_channel_id(rmt_channel_handle_t channel, int *id);
esp_err_t rmt_get_channel_resolution(rmt_channel_handle_t channel, uint32_t *resolution_hz);
