/* SPDX-License-Identifier: MIT */
#include "host_store.h"

#include "machine/tool_notes.h"
#include "port_file.h"
#include "settings/store.h"

#include <stdio.h>
#include <string.h>

enum { FILE_MAX = 8192, HEAD = 4, PATH_MAX_LENGTH = 4096 }; /* head: key, ~key, count (2 bytes) */

/* The last value lists the keys of the others, bit = key, and its complement. */
enum { KEYS_KEY = 0xFF, KEYS_SIZE = 4, ALL_KEYS = 0xFFFF };

_Static_assert((int)STORE_BATCH_SIZE + ((int)STORE_BATCH_VALUES + 1) * (int)HEAD + (int)KEYS_SIZE <=
                   (int)FILE_MAX,
               "the file has room for all values");
_Static_assert((int)STORE_BATCH_SIZE + (int)STORED_NOTE_KEYS * (int)sizeof(struct tool_notes) +
                       (int)HOST_STORE_KEYS * (int)HEAD + (int)KEYS_SIZE + (int)STORE_OTHERS_SIZE <=
                   (int)FILE_MAX,
               "and for a tool table that is full, and the trusted addresses");

/* Where core/settings/store.c has the layout's version in a value. */
enum { VERSION_AT = 4 };

static bool extend(char name[PATH_MAX_LENGTH], const char *path, const char *ending) {
    int length = snprintf(name, PATH_MAX_LENGTH, "%s%s", path, ending);
    return length >= 0 && length < PATH_MAX_LENGTH;
}

static size_t read_file(const char *path, uint8_t bytes[FILE_MAX]) {
    FILE *file = port_open(path, "rb");
    if (file == NULL)
        return 0;
    size_t count = fread(bytes, 1, FILE_MAX, file);
    fclose(file);
    return count;
}

static size_t value_count(const uint8_t *at) {
    return (size_t)at[2] | (size_t)at[3] << 8;
}

/* A whole value with a sound head begins here. */
static bool is_sound(const uint8_t *bytes, size_t at, size_t count) {
    return at + HEAD <= count && (bytes[at] ^ bytes[at + 1]) == 0xFF &&
           at + HEAD + value_count(bytes + at) <= count;
}

/* @return where the value of key begins, or count: none exists, or where the file is damaged */
static size_t find(const uint8_t *bytes, size_t count, uint8_t key) {
    size_t at = 0;
    while (is_sound(bytes, at, count) && bytes[at] != key)
        at += HEAD + value_count(bytes + at);
    return at;
}

/* Files of firmware up to November 2026 have no list. They are distinguished from one that was cut off by
 * their settings, which are of layout 1. @return the keys of such a file, 0: it is none */
static unsigned keys_without_list(const uint8_t *bytes, size_t count) {
    size_t settings = find(bytes, count, STORE_KEY_SETTINGS), at = 0;
    unsigned keys = 0;
    for (; is_sound(bytes, at, count); at += HEAD + value_count(bytes + at))
        keys |= bytes[at] < HOST_STORE_KEYS ? 1u << bytes[at] : 0;
    bool is_old = at == count && settings < count && value_count(bytes + settings) > VERSION_AT + 1 &&
                  bytes[settings + HEAD + VERSION_AT] == 1 && bytes[settings + HEAD + VERSION_AT + 1] == 0;
    return is_old ? keys : 0;
}

/* Keys of the file by its own word, or all of them where that is damaged or missing. */
static unsigned keys_of(const uint8_t *bytes, size_t count) {
    unsigned old_keys = keys_without_list(bytes, count);
    if (old_keys != 0 && find(bytes, count, KEYS_KEY) == count)
        return old_keys;
    size_t at = find(bytes, count, KEYS_KEY);
    if (at == count || !is_sound(bytes, at, count) || value_count(bytes + at) != KEYS_SIZE)
        return count > 0 ? ALL_KEYS : 0;
    const uint8_t *keys = bytes + at + HEAD;
    bool good = (keys[0] ^ keys[2]) == 0xFF && (keys[1] ^ keys[3]) == 0xFF;
    return good ? keys[0] | (unsigned)keys[1] << 8 : ALL_KEYS;
}

static size_t load(const void *ctx, uint8_t key, void *bytes, size_t size) {
    uint8_t file[FILE_MAX];
    size_t count = read_file(ctx, file);
    size_t at = find(file, count, key);
    if (at < count && is_sound(file, at, count)) {
        size_t value = value_count(file + at) < size ? value_count(file + at) : size;
        memcpy(bytes, file + at + HEAD, value);
        return value;
    }
    if ((keys_of(file, count) >> key & 1) == 0)
        return 0;
    *(uint8_t *)bytes = 0;
    return 1;
}

/* Next to the file, then over it: a reader sees the old or the new one. */
static bool replace(const char *path, const uint8_t *bytes, size_t count) {
    char fresh[PATH_MAX_LENGTH];
    if (!extend(fresh, path, ".new"))
        return false;
    FILE *file = port_open(fresh, "wb");
    if (file == NULL)
        return false;
    bool good = fwrite(bytes, 1, count, file) == count;
    good = port_sync(file) && good;
    good = fclose(file) == 0 && good;
    return good && port_replace(fresh, path);
}

/* @return where the next value goes */
static size_t put(uint8_t *file, size_t at, uint8_t key, const void *bytes, size_t count) {
    const uint8_t head[HEAD] = {key, (uint8_t)~key, (uint8_t)count, (uint8_t)(count >> 8)};
    memcpy(file + at, head, HEAD);
    memcpy(file + at + HEAD, bytes, count);
    return at + HEAD + count;
}

static bool is_among(uint8_t key, const struct hal_store_value *values, size_t count) {
    for (size_t i = 0; i < count; i++)
        if (values[i].key == key)
            return true;
    return false;
}

/* What of the old file stays. @return bytes */
static size_t copy_others(uint8_t *fresh, const uint8_t *old, size_t held,
                          const struct hal_store_value *values, size_t count) {
    size_t used = 0;
    for (size_t at = 0; is_sound(old, at, held); at += HEAD + value_count(old + at)) {
        size_t whole = HEAD + value_count(old + at);
        if (old[at] == KEYS_KEY || is_among(old[at], values, count))
            continue;
        memcpy(fresh + used, old + at, whole);
        used += whole;
    }
    return used;
}

/* A value that is lost stays so: the list of keys continues to name it. */
static enum hal_store_state save(const void *ctx, const struct hal_store_value *values, size_t count) {
    uint8_t old[FILE_MAX], fresh[FILE_MAX];
    size_t held = read_file(ctx, old);
    unsigned keys = keys_of(old, held);
    size_t used = copy_others(fresh, old, held, values, count);
    for (size_t i = 0; i < count; i++) {
        if (values[i].key >= HOST_STORE_KEYS || values[i].count > UINT16_MAX ||
            values[i].count + 2 * HEAD + KEYS_SIZE > FILE_MAX - used)
            return HAL_STORE_FAILED;
        keys |= 1u << values[i].key;
        used = put(fresh, used, values[i].key, values[i].bytes, values[i].count);
    }
    const uint8_t list[KEYS_SIZE] = {(uint8_t)keys, (uint8_t)(keys >> 8), (uint8_t)~keys,
                                     (uint8_t)(~keys >> 8)};
    if (used + HEAD + KEYS_SIZE > FILE_MAX)
        return HAL_STORE_FAILED;
    used = put(fresh, used, KEYS_KEY, list, sizeof list);
    return replace(ctx, fresh, used) ? HAL_STORE_DONE : HAL_STORE_FAILED;
}

static enum hal_store_state set_aside(const void *ctx) {
    uint8_t file[FILE_MAX];
    char aside[PATH_MAX_LENGTH];
    size_t count = read_file(ctx, file);
    bool copied = extend(aside, ctx, ".damaged") && replace(aside, file, count);
    return copied ? HAL_STORE_DONE : HAL_STORE_FAILED;
}

const struct hal_store host_store = {.load = load, .save = save, .set_aside = set_aside};
