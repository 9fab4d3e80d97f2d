/* SPDX-License-Identifier: MIT
 * This board as keys of the binary protocol. [task] */
#ifndef WIFICNC_ESP32_DEVICE_KEYS_H
#define WIFICNC_ESP32_DEVICE_KEYS_H

#include "device/device.h"
#include "io/pin_map.h"
#include "store/nvs_store.h"

/** What is on this start: the board's pins, with what the storage has moved. On the heap, because most starts
 * need no more than a few of its bytes; never freed. @return NULL: no memory */
struct device *device_keys_create(const struct pin_map *map, struct nvs_store *store);

#endif
