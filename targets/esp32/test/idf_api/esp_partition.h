/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_partition.h, declared again: enough to compile against, checked against
 * the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "esp_err.h"

typedef struct {
    uint32_t address, size;
} esp_partition_t;
