/* SPDX-License-Identifier: MIT */
#include "net_json.h"

#include <stdint.h>
#include <string.h>

static const char *skip_blanks(const char *at) {
    return at + strspn(at, " \t\r\n");
}

/* Where a decoded text is written. */
struct text {
    char *bytes;
    size_t size, count;
};

/* @return false: no room for it and the NUL */
static bool put_byte(struct text *out, uint32_t byte) {
    if (out->count + 1 >= out->size)
        return false;
    out->bytes[out->count++] = (char)byte;
    return true;
}

static bool put_code(struct text *out, uint32_t code) {
    if (code < 0x80)
        return code != 0 && put_byte(out, code);
    if (code < 0x800)
        return put_byte(out, 0xC0 | code >> 6) && put_byte(out, 0x80 | (code & 63));
    if (code < 0x10000)
        return put_byte(out, 0xE0 | code >> 12) && put_byte(out, 0x80 | (code >> 6 & 63)) &&
               put_byte(out, 0x80 | (code & 63));
    return put_byte(out, 0xF0 | code >> 18) && put_byte(out, 0x80 | (code >> 12 & 63)) &&
           put_byte(out, 0x80 | (code >> 6 & 63)) && put_byte(out, 0x80 | (code & 63));
}

/* Four digits. @return NULL: they are not */
static const char *take_hex(const char *at, uint32_t *code) {
    static const char digits[] = "0123456789abcdef";
    *code = 0;
    for (int i = 0; i < 4; i++, at++) {
        const char *digit = *at == '\0' ? NULL : strchr(digits, *at >= 'A' && *at <= 'F' ? *at | 0x20 : *at);
        if (digit == NULL)
            return NULL;
        *code = *code << 4 | (uint32_t)(digit - digits);
    }
    return at;
}

/* Behind \u; characters beyond 16 bits come as two. */
static const char *take_code(const char *at, struct text *out) {
    uint32_t code, low;
    at = take_hex(at, &code);
    if (at == NULL || (code >= 0xDC00 && code < 0xE000))
        return NULL;
    if (code >= 0xD800 && code < 0xDC00) {
        if (at[0] != '\\' || at[1] != 'u' || (at = take_hex(at + 2, &low)) == NULL || low < 0xDC00 ||
            low >= 0xE000)
            return NULL;
        code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
    }
    return put_code(out, code) ? at : NULL;
}

static const char *take_escape(const char *at, struct text *out) {
    static const char names[] = "\"\\/bfnrt", meanings[] = "\"\\/\b\f\n\r\t";
    const char *name = *at == '\0' ? NULL : strchr(names, *at);
    if (*at == 'u')
        return take_code(at + 1, out);
    return name != NULL && put_byte(out, (uint8_t)meanings[name - names]) ? at + 1 : NULL;
}

/* @return behind the closing quote; NULL: it is damaged, or too long */
static const char *take_text(const char *at, char *bytes, size_t size) {
    struct text out = {.bytes = bytes, .size = size};
    if (*at++ != '"')
        return NULL;
    while (at != NULL && *at != '"') {
        if ((uint8_t)*at < ' ')
            return NULL;
        if (*at == '\\')
            at = take_escape(at + 1, &out);
        else
            at = put_byte(&out, (uint8_t)*at) ? at + 1 : NULL;
    }
    bytes[out.count] = '\0';
    return at == NULL ? NULL : at + 1;
}

/* A number or a word; what it is worth is the caller's to see. */
static const char *take_word(const char *at, char *bytes, size_t size) {
    const size_t count = strspn(at, "abcdefghijklmnopqrstuvwxyz0123456789+-.E");
    if (count == 0 || count >= size)
        return NULL;
    memcpy(bytes, at, count);
    bytes[count] = '\0';
    return at + count;
}

/* @return behind it; NULL: it is damaged, or refused */
static const char *take_member(const char *at, net_json_member *member, void *ctx) {
    char name[NET_JSON_NAME], value[NET_JSON_VALUE];
    at = take_text(skip_blanks(at), name, sizeof name);
    if (at == NULL || *(at = skip_blanks(at)) != ':')
        return NULL;
    at = skip_blanks(at + 1);
    const bool is_text = *at == '"';
    at = is_text ? take_text(at, value, sizeof value) : take_word(at, value, sizeof value);
    return at != NULL && member(ctx, name, value, is_text) ? skip_blanks(at) : NULL;
}

bool net_json_read(const char *json, net_json_member *member, void *ctx) {
    const char *at = skip_blanks(json);
    if (*at != '{')
        return false;
    at = skip_blanks(at + 1);
    if (*at == '}')
        return *skip_blanks(at + 1) == '\0';
    for (;;) {
        at = take_member(at, member, ctx);
        if (at == NULL || (*at != ',' && *at != '}'))
            return false;
        if (*at++ == '}')
            return *skip_blanks(at) == '\0';
    }
}

size_t net_json_put_text(char *out, size_t size, const char *text) {
    static const char digits[] = "0123456789abcdef";
    size_t count = 0;
    if (size < 3)
        return 0;
    out[count++] = '"';
    for (; *text != '\0'; text++) {
        if (count + 8 > size) /* the longest escape, a quote and the NUL */
            return 0;
        if ((uint8_t)*text < ' ') {
            memcpy(out + count, "\\u00", 4);
            out[count + 4] = digits[*text >> 4];
            out[count + 5] = digits[*text & 15];
            count += 6;
            continue;
        }
        if (*text == '"' || *text == '\\')
            out[count++] = '\\';
        out[count++] = *text;
    }
    out[count++] = '"';
    out[count] = '\0';
    return count;
}
