/* SPDX-License-Identifier: MIT */
#include "net/access_store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Static_assert((int)ACCESS_KEY_BYTES == (int)ACCESS_KEY_MAX, "as long as the storage may have it");

enum { DIGITS = 16 }; /* of an address, which commas separate */

_Static_assert((int)ACCESS_STORED *(DIGITS + 1) - 1 == (int)TRUSTED_MAX, "all have room");

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

void access_store_load_trust(struct access *access, const struct access_store_ops *ops, void *ctx) {
    uint64_t stored[ACCESS_STORED];
    char text[TRUSTED_MAX + 1];
    unsigned count = 0;
    if (ops->read(ctx, NVS_TRUSTED, text, sizeof text) != NVS_TEXT_GOOD)
        return;
    for (char *at = text; count < ACCESS_STORED && strspn(at, "0123456789abcdef") == DIGITS;
         at += DIGITS + 1) {
        char *end;
        stored[count++] = strtoull(at, &end, 16);
        if (*end == '\0')
            break;
    }
    access_restore(access, stored, count);
}

bool access_store_keep_trust(struct access *access, const struct access_store_ops *ops, void *ctx) {
    uint64_t stored[ACCESS_STORED];
    char text[TRUSTED_MAX + 1] = "-"; /* none: a text that is empty is not stored */
    const unsigned count = access_stored(access, stored);
    for (unsigned i = 0; i < count; i++)
        snprintf(text + i * (DIGITS + 1), DIGITS + 2, i + 1 < count ? "%08x%08x," : "%08x%08x",
                 (unsigned)(stored[i] >> 32), (unsigned)(stored[i] & UINT32_MAX));
    access->changed = false;
    return ops->write(ctx, NVS_TRUSTED, text);
}
