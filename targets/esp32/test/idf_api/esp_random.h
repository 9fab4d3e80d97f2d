/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_random.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stddef.h>
#include <stdint.h>

void esp_fill_random(void *bytes, size_t count);
