/* SPDX-License-Identifier: MIT */
#include "host_store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { FILE_MAX = 4096, HEAD = 3, PATH_MAX_LENGTH = 4096 };

static size_t read_file(const char *path, uint8_t bytes[FILE_MAX]) {
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return 0;
    size_t count = fread(bytes, 1, FILE_MAX, file);
    fclose(file);
    return count;
}

static size_t value_count(const uint8_t *at) {
    return (size_t)at[1] | (size_t)at[2] << 8;
}

/* @return where the value of key begins, or count */
static size_t find(const uint8_t *bytes, size_t count, uint8_t key) {
    size_t at = 0;
    while (at + HEAD <= count && bytes[at] != key)
        at += HEAD + value_count(bytes + at);
    return at + HEAD <= count ? at : count;
}

static size_t load(const void *ctx, uint8_t key, void *bytes, size_t size) {
    uint8_t file[FILE_MAX];
    size_t count = read_file(ctx, file);
    size_t at = find(file, count, key);
    if (at == count)
        return 0;
    size_t value = value_count(file + at);
    size_t there = count - at - HEAD; /* a file cut short: the core sees a wrong size */
    value = value < there ? value : there;
    value = value < size ? value : size;
    memcpy(bytes, file + at + HEAD, value);
    return value > 0 ? value : 1;
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
    for (size_t at = 0; at + HEAD <= held;) {
        size_t whole = HEAD + value_count(old + at);
        if (at + whole > held)
            break; /* cut short */
        if (old[at] != key && used + whole <= FILE_MAX - HEAD - count) {
            memcpy(fresh + used, old + at, whole);
            used += whole;
        }
        at += whole;
    }
    fresh[used] = key;
    fresh[used + 1] = (uint8_t)count;
    fresh[used + 2] = (uint8_t)(count >> 8);
    memcpy(fresh + used + HEAD, bytes, count);
    return replace(ctx, fresh, used + HEAD + count);
}

const struct hal_store host_store = {.load = load, .save = save};
