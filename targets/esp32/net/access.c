/* SPDX-License-Identifier: MIT */
#include "net/access.h"

#include <string.h>

/* A password exists and cannot be read, so an unknown one takes its place: no one can log in. Six bits of
 * each byte, as printable characters. */
static void make_unknown(char password[ACCESS_PASSWORD_MAX + 1], const struct access_ops *ops, void *ctx) {
    uint8_t bytes[ACCESS_PASSWORD_MAX];
    ops->random(ctx, bytes, sizeof bytes);
    for (size_t i = 0; i < sizeof bytes; i++)
        password[i] = (char)('0' + (bytes[i] & 63));
    password[sizeof bytes] = '\0';
}

enum access_state access_load(char password[ACCESS_PASSWORD_MAX + 1], const struct access_ops *ops,
                              void *ctx) {
    enum nvs_text found = ops->read(ctx, NVS_ACCESS_PASSWORD, password, ACCESS_PASSWORD_MAX + 1);
    if (found == NVS_TEXT_GOOD && strlen(password) >= ACCESS_PASSWORD_MIN)
        return ACCESS_LOCKED;
    if (found == NVS_TEXT_NONE) {
        password[0] = '\0';
        return ACCESS_OPEN;
    }
    make_unknown(password, ops, ctx);
    return ACCESS_LOST;
}
