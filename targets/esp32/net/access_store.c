/* SPDX-License-Identifier: MIT */
#include "net/access_store.h"

#include <string.h>

_Static_assert((int)ACCESS_KEY_BYTES == (int)ACCESS_KEY_MAX, "as long as the storage may have it");

static void make_key(char key[ACCESS_KEY_MAX + 1], const struct access_store_ops *ops, void *ctx) {
    uint8_t bytes[ACCESS_MADE_SIZE];
    ops->random(ctx, bytes, sizeof bytes);
    access_make_key(bytes, key);
}

enum access_found access_store_load(char key[ACCESS_KEY_MAX + 1], const struct access_store_ops *ops,
                                    void *ctx) {
    enum nvs_text found = ops->read(ctx, NVS_ACCESS_KEY, key, ACCESS_KEY_MAX + 1);
    if (found == NVS_TEXT_GOOD && strlen(key) >= ACCESS_KEY_MIN)
        return ACCESS_FOUND;
    /* Where a key exists and cannot be read, an unknown one takes its place. */
    make_key(key, ops, ctx);
    if (found != NVS_TEXT_NONE)
        return ACCESS_LOST;
    return ops->write(ctx, NVS_ACCESS_KEY, key) ? ACCESS_MADE : ACCESS_UNKEPT;
}
