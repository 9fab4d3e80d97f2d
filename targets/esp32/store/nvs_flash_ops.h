/* SPDX-License-Identifier: MIT
 * struct nvs_ops over ESP-IDF's NVS, namespace "wificnc" of the default partition. [task] */
#ifndef WIFICNC_ESP32_NVS_FLASH_OPS_H
#define WIFICNC_ESP32_NVS_FLASH_OPS_H

#include "net/access_store.h" // enum nvs_text
#include "store/nvs_store.h"

#include <stdbool.h>
#include <stddef.h>

/** What nvs_flash_ops_open() found. */
enum nvs_start { NVS_START_GOOD, NVS_START_ERASED, NVS_START_FAILED };

/** Open the partition. One of a newer layout, or without a free page, cannot be used: it is erased, and the
 * result says so. @param[out] store  usable unless NVS_START_FAILED */
enum nvs_start nvs_flash_ops_open(struct nvs_store *store);

/** [task] A text, such as the name of the WiFi network. @return its length; 0: none, or it does not fit */
size_t nvs_flash_ops_get_text(const struct nvs_store *store, const char *key, char *text, size_t size);

/** [task] The same where it matters why there is none. A storage that does not work is unreadable, too. */
enum nvs_text nvs_flash_ops_find_text(const struct nvs_store *store, const char *key, char *text,
                                      size_t size);

/** [task] @return false: not kept */
bool nvs_flash_ops_set_text(const struct nvs_store *store, const char *key, const char *text);

#endif
