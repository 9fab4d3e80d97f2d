/* SPDX-License-Identifier: MIT
 * The password of network clients, as it lies in the storage. [start, task] The storage is ops: it runs on a
 * computer, too. */
#ifndef WIFICNC_ESP32_ACCESS_H
#define WIFICNC_ESP32_ACCESS_H

#include "store/nvs_names.h"

#include <stddef.h>
#include <stdint.h>

/** What a read of a text has found. */
enum nvs_text { NVS_TEXT_NONE, NVS_TEXT_GOOD, NVS_TEXT_UNREADABLE };

struct access_ops {
    /** @param[out] text  NUL-terminated when NVS_TEXT_GOOD; what does not fit `size` is NVS_TEXT_UNREADABLE
     */
    enum nvs_text (*read)(void *ctx, const char *key, char *text, size_t size);
    /** Bytes that no one can foretell. */
    void (*random)(void *ctx, uint8_t *bytes, size_t count);
};

enum access_state {
    ACCESS_OPEN,   /* no one has set a password */
    ACCESS_LOCKED, /* there is one */
    ACCESS_LOST,   /* there may be one, and it cannot be read: no one gets in */
};

/** @param[out] password  "" when ACCESS_OPEN; when ACCESS_LOST one that no one knows */
enum access_state access_load(char password[ACCESS_PASSWORD_MAX + 1], const struct access_ops *ops,
                              void *ctx);

#endif
