/* SPDX-License-Identifier: MIT
 * Values that survive a power cut: key -> bytes, with a version and a CRC. [task]
 *
 *   value = { crc32 of the rest | version | count } payload        little-endian
 *
 * The HAL keeps one value of a key atomically (struct hal_store); this file notices when it did not. Settings
 * are kept by number, as { number, value, check } each, and go through settings_set() when they are loaded:
 * so no image, however old or damaged, brings in a value that a user could not have typed, and a damaged
 * setting does not take the others along.
 *
 * What is stored already is not written again: flash wears. */
#ifndef WIFICNC_SETTINGS_STORE_H
#define WIFICNC_SETTINGS_STORE_H

#include "hal/hal.h"
#include "settings/settings.h"

#include <stddef.h>

/** The key of the settings' value; those of the others are the machine's. And the layout versions: a value of
 * another one counts as damaged, but settings of layout 1, which are read, and written in this one. */
enum { STORE_KEY_SETTINGS = 1, STORE_VERSION = 1, STORE_SETTINGS_VERSION = 2 };

/** Longest payload and longest image, bytes: all settings, or the longest of the machine's other values. What
 * the settings take follows from their table; core/machine/stored_write.c asserts that its values fit. */
enum {
    STORE_HEAD_SIZE = 8,
    STORE_PAIR_SIZE = 8,
    STORE_SETTINGS_SIZE = SETTINGS_COUNT * STORE_PAIR_SIZE,
    STORE_OTHERS_SIZE = 400,
    STORE_SIZE_MAX = (int)STORE_SETTINGS_SIZE > (int)STORE_OTHERS_SIZE ? (int)STORE_SETTINGS_SIZE
                                                                       : (int)STORE_OTHERS_SIZE,
    STORE_IMAGE_MAX = STORE_HEAD_SIZE + STORE_SIZE_MAX
};

/** Where values are kept. ops may be NULL: nothing is kept, nothing is found, and saving is not an error. */
struct store {
    const struct hal_store *ops;
    const void *ctx;
};

enum store_result {
    STORE_EMPTY, /* never saved */
    STORE_FOUND,
    STORE_DAMAGED, /* CRC, version or size is wrong */
};

/** Settings that could not be read, the first of them by number. */
enum { STORE_LOST_MAX = 4 };
struct store_lost {
    uint16_t count;
    uint16_t number[STORE_LOST_MAX];
};

/** @param size  of the payload, at most STORE_SIZE_MAX; what is kept must have it exactly
 *  @return other than STORE_FOUND: bytes are undefined. */
enum store_result store_load(const struct store *store, uint8_t key, uint8_t version, void *bytes,
                             size_t size);

/** A value that may be shorter. @param[out] count  bytes of it; 0 unless STORE_FOUND */
enum store_result store_load_up_to(const struct store *store, uint8_t key, uint8_t version, void *bytes,
                                   size_t size, size_t *count);

/** Values that are stored together: after a power cut all of them are there, or none. */
enum {
    STORE_BATCH_VALUES = 12,
    STORE_OTHERS_ROOM = 1240, /* images of the machine's other values */
    STORE_BATCH_SIZE = STORE_HEAD_SIZE + STORE_SETTINGS_SIZE + STORE_OTHERS_ROOM
};
struct store_batch {
    struct hal_store_value values[STORE_BATCH_VALUES];
    size_t count, used; /* values; of bytes */
    uint8_t bytes[STORE_BATCH_SIZE];
};

/** Add a value; what is stored already is left out. A batch has room for each value of the machine once. */
void store_add(struct store_batch *batch, const struct store *store, uint8_t key, uint8_t version,
               const void *bytes, size_t size);
void store_add_settings(struct store_batch *batch, const struct store *store,
                        const struct settings *settings);

/** Begin to store the batch. @return HAL_STORE_BUSY: store_state() reports how it ends */
enum hal_store_state store_write(const struct store *store, const struct store_batch *batch);

/** The state of the newest store_write() or set_aside(). */
enum hal_store_state store_state(const struct store *store);

/** One value, on a store that is never busy. @return false: not kept; the value before is still there. */
bool store_save(const struct store *store, uint8_t key, uint8_t version, const void *bytes, size_t size);

/** Settings that are not kept, or are of another machine, stay as they are.
 *  @param[out] lost  settings of a damaged image that stay as they are, too
 *  @return STORE_DAMAGED: a value was refused, or the image is damaged; what could be read of it was taken.
 */
enum store_result store_load_settings(const struct store *store, struct settings *settings,
                                      uint8_t axis_count, struct store_lost *lost);

bool store_save_settings(const struct store *store, const struct settings *settings);

/** A setting as it is kept. All of them fit a float exactly. */
struct store_pair {
    uint16_t number;
    float value;
};

/** For targets that keep settings one by one: the image of settings, and what is in it. A setting that was
 * kept and is lost is a pair whose value is NaN.
 *  @param count  at most SETTINGS_COUNT @return bytes of the image, at most STORE_IMAGE_MAX */
size_t store_pack(uint8_t *image, const struct store_pair *pairs, size_t count);

/** @param[out] pairs  room for SETTINGS_COUNT @return how many there are; 0: none, or the image is damaged */
size_t store_unpack(const uint8_t *image, size_t size, struct store_pair *pairs);

#endif
