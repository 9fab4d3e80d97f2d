/* SPDX-License-Identifier: MIT
 * Values that survive a power cut: key -> bytes, with a version and a CRC. [task]
 *
 *   value = { crc32 of the rest | version | count } payload        little-endian
 *
 * The HAL keeps one value of a key atomically (struct hal_store); this file notices when it did not. Settings
 * are kept by number, as { number, value } pairs, and go through settings_set() when they are loaded: so no
 * image, however old or damaged, brings in a value that a user could not have typed. */
#ifndef WIFICNC_SETTINGS_STORE_H
#define WIFICNC_SETTINGS_STORE_H

#include "hal/hal.h"
#include "settings/settings.h"

#include <stddef.h>

/** The key of the settings' value; those of the others are the machine's. And the layout version of all
 * values: a value of another one counts as damaged. */
enum { STORE_KEY_SETTINGS = 1, STORE_VERSION = 1 };

/** Longest payload and longest image, bytes. */
enum { STORE_SIZE_MAX = 480, STORE_IMAGE_MAX = 8 + STORE_SIZE_MAX };

/** Where values are kept. ops may be NULL: nothing is kept, nothing is found, and saving is no error. */
struct store {
    const struct hal_store *ops;
    const void *ctx;
};

enum store_result {
    STORE_EMPTY, /* never saved */
    STORE_FOUND,
    STORE_DAMAGED, /* CRC, version or size is wrong */
};

/** @param size  of the payload, at most STORE_SIZE_MAX; what is kept must have it exactly
 *  @return other than STORE_FOUND: bytes are undefined. */
enum store_result store_load(const struct store *store, uint8_t key, uint8_t version, void *bytes,
                             size_t size);

/** @return false: not kept; the value before is still there. */
bool store_save(const struct store *store, uint8_t key, uint8_t version, const void *bytes, size_t size);

/** Settings that are not kept, or are of another machine, stay as they are.
 *  @return STORE_DAMAGED: a value was refused, or the image is damaged; *settings is unchanged then. */
enum store_result store_load_settings(const struct store *store, uint8_t key, uint8_t version,
                                      struct settings *settings, uint8_t axis_count);

bool store_save_settings(const struct store *store, uint8_t key, uint8_t version,
                         const struct settings *settings);

/** A setting as it is kept. All of them fit a float exactly. */
struct store_pair {
    uint16_t number;
    float value;
};

/** For targets that keep settings one by one: the image of settings, and what is in it.
 *  @param count  at most SETTINGS_COUNT @return bytes of the image, at most STORE_IMAGE_MAX */
size_t store_pack(uint8_t *image, uint8_t version, const struct store_pair *pairs, size_t count);

/** @param[out] pairs  room for SETTINGS_COUNT @return how many there are; 0: none, or the image is damaged */
size_t store_unpack(const uint8_t *image, size_t size, uint8_t version, struct store_pair *pairs);

#endif
