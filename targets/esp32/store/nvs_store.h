/* SPDX-License-Identifier: MIT
 * What the core keeps (hal_store), in NVS: settings one by one under their own keys, so that `wificnc nvs`
 * and older firmware find them, the rest as blobs. [task] No NVS call here: the store is ops.
 *
 * NVS keeps each key atomically, not several. When more than one changes, all values of the write first go
 * into one blob, JOURNAL; a start that finds it there finishes the job. So a power cut leaves all old or all
 * new values.
 *
 * NVS checks each entry and drops a damaged one, which then looks as if it had never been stored. So STORED
 * lists what is: a listed value that is missing is lost, and the core learns it. */
#ifndef WIFICNC_ESP32_NVS_STORE_H
#define WIFICNC_ESP32_NVS_STORE_H

#include "hal/hal.h"
#include "store/nvs_keys.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Each call is atomic over a power cut. */
struct nvs_ops {
    /** @return false: no such key, or it is of another type */
    bool (*get)(void *ctx, const char *key, enum nvs_type type, uint32_t *value);
    bool (*set)(void *ctx, const char *key, enum nvs_type type, uint32_t value);
    /** @return bytes of the blob, copied if they fit; 0: none */
    size_t (*get_blob)(void *ctx, const char *key, void *bytes, size_t size);
    bool (*set_blob)(void *ctx, const char *key, const void *bytes, size_t count);
    bool (*erase)(void *ctx, const char *key);
    /** @return its length; 0: none, or it does not fit */
    size_t (*get_text)(void *ctx, const char *key, char *text, size_t size);
    bool (*set_text)(void *ctx, const char *key, const char *text);
};

struct nvs_store {
    const struct nvs_ops *ops;
    void *ctx;
};

/** ctx is a struct nvs_store. */
extern const struct hal_store nvs_hal_store;

#endif
