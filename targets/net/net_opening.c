/* SPDX-License-Identifier: MIT */
#include "net_opening.h"

#include <stdbool.h>
#include <string.h>

enum { TLS_HANDSHAKE = 0x16, STUN_BINDING = 0x01, STUN_ALLOCATE = 0x03, TOKEN_MAX = 24 };

/* A G-code letter has a number behind it, and a `$` line begins with `$`: letters and a blank are neither. */
static bool is_token(uint8_t byte) {
    return (byte >= 'A' && byte <= 'Z') || (byte >= 'a' && byte <= 'z') || byte == '-' || byte == '_';
}

/* Whose target need not begin with a slash. */
static bool is_method(const char *token, size_t size) {
    static const char *const methods[] = {"GET",     "HEAD",  "POST",  "PUT",     "DELETE",
                                          "OPTIONS", "PATCH", "TRACE", "CONNECT", "PRI"};
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; i++)
        if (strlen(methods[i]) == size && memcmp(token, methods[i], size) == 0)
            return true;
    return false;
}

static enum net_opening_is take_first(uint8_t byte) {
    if (byte == TLS_HANDSHAKE)
        return NET_OPENING_FOREIGN;
    return byte == 0 || is_token(byte) ? NET_OPENING_MORE : NET_OPENING_LINES;
}

enum net_opening_is net_opening_take(const char *held, size_t count, uint8_t byte) {
    if (count == 0)
        return take_first(byte);
    if (held[0] == '\0')
        return byte == STUN_BINDING || byte == STUN_ALLOCATE ? NET_OPENING_FOREIGN : NET_OPENING_LINES;
    if (held[count - 1] == ' ')
        return byte == '/' || byte == '*' ? NET_OPENING_HTTP : NET_OPENING_LINES;
    if (byte == ' ' && is_method(held, count))
        return NET_OPENING_HTTP;
    return byte == ' ' || (is_token(byte) && count < TOKEN_MAX) ? NET_OPENING_MORE : NET_OPENING_LINES;
}
