/* SPDX-License-Identifier: MIT */
#include "settings/store.h"

#include "base/axis.h"

#include <string.h>

struct head {
    uint32_t crc; /* of all that follows */
    uint16_t version, count;
};

struct value {
    struct head head;
    uint8_t payload[STORE_SIZE_MAX];
    uint8_t beyond[4]; /* one that is too long does not look like one that fits */
};

_Static_assert(offsetof(struct value, beyond) == STORE_IMAGE_MAX, "head and payload lie close together");

/* CRC-32 of IEEE 802.3, bit by bit: it runs when something is stored, not in motion. */
static uint32_t crc32(const uint8_t *bytes, size_t count) {
    uint32_t crc = 0xFFFFFFFFu;
    for (; count > 0; count--) {
        crc ^= *bytes++;
        for (int bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (0xEDB88320u & (0u - (crc & 1u)));
    }
    return ~crc;
}

static uint32_t value_crc(const struct value *value) {
    const size_t from = offsetof(struct head, version);
    return crc32((const uint8_t *)value + from, sizeof value->head - from + value->head.count);
}

static bool is_sound(const struct value *value, size_t size, uint8_t version) {
    return size >= sizeof value->head && value->head.count == size - sizeof value->head &&
           value->head.version == version && value->head.crc == value_crc(value);
}

static void seal(struct value *value, uint8_t version, size_t payload_size) {
    value->head.version = version;
    value->head.count = (uint16_t)payload_size;
    value->head.crc = value_crc(value);
}

/* What is there, sound or not; another version is not sound. @param[out] count  bytes of value->payload */
static enum store_result load(const struct store *store, uint8_t key, uint8_t version, struct value *value,
                              size_t *count) {
    size_t size = store->ops == NULL ? 0 : store->ops->load(store->ctx, key, value, sizeof *value);
    *count = size > sizeof value->head ? size - sizeof value->head : 0;
    if (size == 0)
        return STORE_EMPTY;
    return is_sound(value, size, version) ? STORE_FOUND : STORE_DAMAGED;
}

/* What is stored already is not written again: that saves wear of the flash, and up to 50 ms. */
static bool is_stored(const struct store *store, uint8_t key, const struct value *value, size_t size) {
    struct value present;
    size_t count;
    (void)load(store, key, (uint8_t)value->head.version, &present, &count);
    return count == size && memcmp(&present, value, sizeof value->head + size) == 0;
}

/* The payload is there. */
static void add(struct store_batch *batch, const struct store *store, uint8_t key, uint8_t version,
                struct value *value, size_t size) {
    seal(value, version, size);
    size_t count = sizeof value->head + size;
    /* There is always room: machine/stored_write.c asserts that a batch holds each value once. */
    if (store->ops == NULL || is_stored(store, key, value, size) || batch->count == STORE_BATCH_VALUES ||
        count > STORE_BATCH_SIZE - batch->used)
        return;
    uint8_t *bytes = batch->bytes + batch->used;
    memcpy(bytes, value, count);
    batch->values[batch->count++] = (struct hal_store_value){.key = key, .bytes = bytes, .count = count};
    batch->used += count;
}

/* The payload is there. */
static bool save(const struct store *store, uint8_t key, uint8_t version, struct value *value, size_t size) {
    seal(value, version, size);
    const struct hal_store_value one = {.key = key, .bytes = value, .count = sizeof value->head + size};
    return store->ops == NULL || is_stored(store, key, value, size) ||
           store->ops->save(store->ctx, &one, 1) == HAL_STORE_DONE;
}

enum hal_store_state store_write(const struct store *store, const struct store_batch *batch) {
    return batch->count == 0 ? HAL_STORE_DONE : store->ops->save(store->ctx, batch->values, batch->count);
}

enum hal_store_state store_state(const struct store *store) {
    return store->ops == NULL || store->ops->state == NULL ? HAL_STORE_DONE : store->ops->state(store->ctx);
}

enum store_result store_load_up_to(const struct store *store, uint8_t key, uint8_t version, void *bytes,
                                   size_t size, size_t *count) {
    struct value value;
    enum store_result result = load(store, key, version, &value, count);
    if (result == STORE_FOUND && *count > size)
        result = STORE_DAMAGED;
    if (result != STORE_FOUND)
        *count = 0;
    memcpy(bytes, value.payload, *count);
    return result;
}

enum store_result store_load(const struct store *store, uint8_t key, uint8_t version, void *bytes,
                             size_t size) {
    size_t count;
    enum store_result result = store_load_up_to(store, key, version, bytes, size, &count);
    return result == STORE_FOUND && count != size ? STORE_DAMAGED : result;
}

bool store_save(const struct store *store, uint8_t key, uint8_t version, const void *bytes, size_t size) {
    struct value value;
    if (size > STORE_SIZE_MAX)
        return false;
    memcpy(value.payload, bytes, size);
    return save(store, key, version, &value, size);
}

void store_add(struct store_batch *batch, const struct store *store, uint8_t key, uint8_t version,
               const void *bytes, size_t size) {
    struct value value;
    if (size > STORE_SIZE_MAX)
        return;
    memcpy(value.payload, bytes, size);
    add(batch, store, key, version, &value, size);
}

/* ---- settings ---- */

/* As it lies there: number, bits of the value, and a check of both. */
struct pair_image {
    uint16_t number, check;
    float value;
};
_Static_assert(sizeof(struct pair_image) == STORE_PAIR_SIZE, "no padding");

/* 16 bits of the CRC for each pair, so that one damaged setting does not take the others with it. */
static uint16_t check_of(const struct pair_image *image) {
    struct pair_image unchecked = *image;
    unchecked.check = 0;
    return (uint16_t)crc32((const uint8_t *)&unchecked, sizeof unchecked);
}

/* Layout 1 of the settings, of firmware up to November 2026: pairs of number and value, without a check. */
enum { OLD_SETTINGS_VERSION = 1, OLD_PAIR_SIZE = 6 };

static size_t pair_size(const struct value *value) {
    return value->head.version == OLD_SETTINGS_VERSION ? OLD_PAIR_SIZE : STORE_PAIR_SIZE;
}

static void old_pair_at(const struct value *value, size_t index, struct store_pair *pair) {
    const uint8_t *at = value->payload + index * OLD_PAIR_SIZE;
    memcpy(&pair->number, at, sizeof pair->number);
    memcpy(&pair->value, at + sizeof pair->number, sizeof pair->value);
}

/* @return false: it is damaged */
static bool pair_at(const struct value *value, size_t index, struct store_pair *pair) {
    struct pair_image image;
    if (value->head.version == OLD_SETTINGS_VERSION) {
        old_pair_at(value, index, pair);
        return true;
    }
    memcpy(&image, value->payload + index * sizeof image, sizeof image);
    *pair = (struct store_pair){.number = image.number, .value = image.value};
    return image.check == check_of(&image);
}

static void put_pair(struct value *value, size_t index, const struct store_pair *pair) {
    struct pair_image image = {.number = pair->number, .value = pair->value};
    image.check = check_of(&image);
    memcpy(value->payload + index * sizeof image, &image, sizeof image);
}

size_t store_pack(uint8_t *image, const struct store_pair *pairs, size_t count) {
    struct value value;
    for (size_t i = 0; i < count; i++)
        put_pair(&value, i, &pairs[i]);
    seal(&value, STORE_SETTINGS_VERSION, count * STORE_PAIR_SIZE);
    memcpy(image, &value, sizeof value.head + value.head.count);
    return sizeof value.head + value.head.count;
}

size_t store_unpack(const uint8_t *image, size_t size, struct store_pair *pairs) {
    struct value value;
    if (size > STORE_IMAGE_MAX)
        return 0;
    memcpy(&value, image, size);
    /* An image as a whole or not at all, other than store_load_settings(), which takes the pairs that are
     * sound. */
    if (!is_sound(&value, size, STORE_SETTINGS_VERSION) || value.head.count > STORE_SETTINGS_SIZE)
        return 0;
    size_t count = value.head.count / STORE_PAIR_SIZE;
    for (size_t index = 0; index < count; index++)
        if (!pair_at(&value, index, &pairs[index]))
            return 0;
    return count;
}

/* An image of settings on its way into the settings. */
struct intake {
    const struct value *value;
    size_t count; /* bytes of the payload */
    bool sound;
    struct settings *settings;
    uint8_t axis_count;
    struct store_lost *lost;
};

/* The first ones by number. */
static void note_lost(struct store_lost *lost, uint16_t number) {
    if (lost->count < STORE_LOST_MAX)
        lost->number[lost->count] = number;
    lost->count++;
}

/* Both layouts begin a pair with its number. The check of a pair costs 500 instructions: only of those that
 * have the number, or the time of a power-on grows with the square of the settings. */
static bool has_number(const struct intake *intake, size_t index, uint16_t number) {
    uint16_t found;
    memcpy(&found, intake->value->payload + index * pair_size(intake->value), sizeof found);
    return found == number;
}

static bool find_pair(const struct intake *intake, uint16_t number, struct store_pair *pair) {
    for (size_t index = 0; index < intake->count / pair_size(intake->value); index++)
        if (has_number(intake, index, number) && pair_at(intake->value, index, pair))
            return true;
    return false;
}

static void take_setting(const struct intake *intake, uint16_t number) {
    struct store_pair pair;
    double present;
    uint8_t decimals;
    if (!find_pair(intake, number, &pair)) {
        if (!intake->sound)
            note_lost(intake->lost, number);
        return;
    }
    (void)settings_get(intake->settings, number, intake->axis_count, &present, &decimals);
    if (present == (double)pair.value)
        return; /* a board may begin with a value that no one can type */
    if (settings_set(intake->settings, number, (double)pair.value, intake->axis_count) != STATUS_OK)
        note_lost(intake->lost, number);
}

/* By number. Some need others first ($20, $94 to $97): again, until that takes none of them. */
static void take_settings(const struct intake *intake) {
    struct store_lost *lost = intake->lost;
    unsigned before;
    lost->count = UINT16_MAX;
    do {
        before = lost->count;
        lost->count = 0;
        uint16_t number = SETTINGS_BEGIN;
        while (settings_next(&number, intake->axis_count))
            take_setting(intake, number);
    } while (lost->count > 0 && lost->count < before);
}

/* Of the present layout, or of layout 1 and whole: its pairs have no checks. */
static enum store_result load_settings(const struct store *store, struct value *value, size_t *count) {
    enum store_result result = load(store, STORE_KEY_SETTINGS, OLD_SETTINGS_VERSION, value, count);
    if (result == STORE_FOUND)
        return result;
    result = load(store, STORE_KEY_SETTINGS, STORE_SETTINGS_VERSION, value, count);
    value->head.version = STORE_SETTINGS_VERSION; /* whatever damage has made of it */
    return result;
}

enum store_result store_load_settings(const struct store *store, struct settings *settings,
                                      uint8_t axis_count, struct store_lost *lost) {
    struct value value;
    struct intake intake = {.value = &value, .settings = settings, .axis_count = axis_count, .lost = lost};
    enum store_result result = load_settings(store, &value, &intake.count);
    *lost = (struct store_lost){.count = 0};
    if (result == STORE_EMPTY)
        return result;
    intake.sound = result == STORE_FOUND && intake.count % pair_size(&value) == 0;
    take_settings(&intake);
    return intake.sound && lost->count == 0 ? STORE_FOUND : STORE_DAMAGED;
}

/* @return bytes of the payload */
static size_t put_settings(struct value *value, const struct settings *settings) {
    size_t count = 0;
    uint16_t number = SETTINGS_BEGIN;
    while (settings_next(&number, AXIS_COUNT)) {
        double read;
        uint8_t decimals;
        if (settings_get(settings, number, AXIS_COUNT, &read, &decimals))
            put_pair(value, count++, &(struct store_pair){.number = number, .value = (float)read});
    }
    return count * STORE_PAIR_SIZE;
}

void store_add_settings(struct store_batch *batch, const struct store *store,
                        const struct settings *settings) {
    struct value value;
    size_t size = put_settings(&value, settings);
    add(batch, store, STORE_KEY_SETTINGS, STORE_SETTINGS_VERSION, &value, size);
}

bool store_save_settings(const struct store *store, const struct settings *settings) {
    struct value value;
    size_t size = put_settings(&value, settings);
    return save(store, STORE_KEY_SETTINGS, STORE_SETTINGS_VERSION, &value, size);
}
