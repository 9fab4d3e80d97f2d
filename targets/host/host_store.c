/* SPDX-License-Identifier: MIT */
#include "host_store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { FILE_MAX = 4096, HEAD = 4, PATH_MAX_LENGTH = 4096 }; /* key, ~key, count (2 bytes) */

static size_t read_file(const char *path, uint8_t bytes[FILE_MAX]) {
    FILE *file = fopen(path, "rb");
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

/* @return where the value of key begins, or count: there is none, or where the file is damaged */
static size_t find(const uint8_t *bytes, size_t count, uint8_t key) {
    size_t at = 0;
    while (is_sound(bytes, at, count) && bytes[at] != key)
        at += HEAD + value_count(bytes + at);
    return at;
}

/* What cannot be read is given to the core as one byte, which no sound value is: it sees the damage. */
static size_t load(const void *ctx, uint8_t key, void *bytes, size_t size) {
    uint8_t file[FILE_MAX];
    size_t count = read_file(ctx, file);
    size_t at = find(file, count, key);
    if (at == count)
        return 0;
    size_t value = is_sound(file, at, count) ? value_count(file + at) : 1;
    value = value < size ? value : size;
    memcpy(bytes, is_sound(file, at, count) ? file + at + HEAD : file + at, value);
    return value;
}

/* Beside the file, then over it: whoever reads sees the old or the new one. */
static bool replace(const char *path, const uint8_t *bytes, size_t count) {
    char fresh[PATH_MAX_LENGTH];
    int length = snprintf(fresh, sizeof fresh, "%s.new", path);
    if (length < 0 || (size_t)length >= sizeof fresh)
        return false;
    FILE *file = fopen(fresh, "wb");
    if (file == NULL)
        return false;
    bool good = fwrite(bytes, 1, count, file) == count;
    good = fflush(file) == 0 && good;
    good = fsync(fileno(file)) == 0 && good;
    good = fclose(file) == 0 && good;
    return good && rename(fresh, path) == 0;
}

static bool save(const void *ctx, uint8_t key, const void *bytes, size_t count) {
    uint8_t old[FILE_MAX], fresh[FILE_MAX];
    size_t held = read_file(ctx, old), used = 0;
    if (count > UINT16_MAX || HEAD + count > FILE_MAX)
        return false;
    for (size_t at = 0; is_sound(old, at, held); at += HEAD + value_count(old + at)) {
        size_t whole = HEAD + value_count(old + at);
        if (old[at] == key || used + whole > FILE_MAX - HEAD - count)
            continue;
        memcpy(fresh + used, old + at, whole);
        used += whole;
    }
    fresh[used] = key;
    fresh[used + 1] = (uint8_t)~key;
    fresh[used + 2] = (uint8_t)count;
    fresh[used + 3] = (uint8_t)(count >> 8);
    memcpy(fresh + used + HEAD, bytes, count);
    return replace(ctx, fresh, used + HEAD + count);
}

const struct hal_store host_store = {.load = load, .save = save};
