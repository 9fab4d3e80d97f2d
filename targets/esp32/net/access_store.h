/* SPDX-License-Identifier: MIT
 * The access key of network clients, as it lies in the storage. [start, task] The storage is ops: it runs on
 * a computer, too. */
#ifndef WIFICNC_ESP32_ACCESS_STORE_H
#define WIFICNC_ESP32_ACCESS_STORE_H

#include "access/access.h"
#include "store/nvs_names.h"

/** What a read of a text has found. */
enum nvs_text { NVS_TEXT_NONE, NVS_TEXT_GOOD, NVS_TEXT_UNREADABLE };

struct access_store_ops {
    /** @param[out] text  NUL-terminated when NVS_TEXT_GOOD; what does not fit `size` is NVS_TEXT_UNREADABLE
     */
    enum nvs_text (*read)(void *ctx, const char *key, char *text, size_t size);
    /** @return false: it is not kept */
    bool (*write)(void *ctx, const char *key, const char *text);
    /** Bytes that no one can foretell. */
    void (*random)(void *ctx, uint8_t *bytes, size_t count);
};

enum access_found {
    ACCESS_FOUND,  /* there is one */
    ACCESS_MADE,   /* there was none: it is new, and kept */
    ACCESS_UNKEPT, /* it is new, and could not be stored: the next start has another */
    ACCESS_LOST,   /* there may be one, and it cannot be read: no one gets in */
};

/** @param[out] key  when ACCESS_LOST one that no one knows */
enum access_found access_store_load(char key[ACCESS_KEY_MAX + 1], const struct access_store_ops *ops,
                                    void *ctx);

/** Trust the addresses that are stored. Those that cannot be read are not trusted. */
void access_store_load_trust(struct access *access, const struct access_store_ops *ops, void *ctx);

/** Store them. @return false: they are not kept */
bool access_store_keep_trust(struct access *access, const struct access_store_ops *ops, void *ctx);

#endif
