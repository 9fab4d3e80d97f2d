/* SPDX-License-Identifier: MIT */
#include "settings/store.h"

#include "base/axis.h"

#include <string.h>

#define HOMING_NUMBER 22 /* before $20, which needs it */

struct head {
    uint32_t crc; /* of all that follows */
    uint16_t version, count;
};

struct value {
    struct head head;
    uint8_t payload[STORE_SIZE_MAX];
};

_Static_assert(sizeof(struct value) == STORE_IMAGE_MAX, "head and payload lie close together");

/* 6 bytes: number, then the bits of the value. */
enum { PAIR_SIZE = 6 };
_Static_assert(SETTINGS_COUNT *PAIR_SIZE <= STORE_SIZE_MAX, "all settings fit one value");

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

/* @return STORE_FOUND and a payload of value->head.count bytes */
static enum store_result load(const struct store *store, uint8_t key, uint8_t version, struct value *value) {
    if (store->ops == NULL)
        return STORE_EMPTY;
    size_t count = store->ops->load(store->ctx, key, value, sizeof *value);
    if (count == 0)
        return STORE_EMPTY;
    return is_sound(value, count, version) ? STORE_FOUND : STORE_DAMAGED;
}

/* The payload is there. */
static bool save(const struct store *store, uint8_t key, uint8_t version, struct value *value, size_t size) {
    seal(value, version, size);
    return store->ops == NULL || store->ops->save(store->ctx, key, value, sizeof value->head + size);
}

enum store_result store_load(const struct store *store, uint8_t key, uint8_t version, void *bytes,
                             size_t size) {
    struct value value;
    enum store_result result = load(store, key, version, &value);
    if (result != STORE_FOUND)
        return result;
    if (value.head.count != size)
        return STORE_DAMAGED;
    memcpy(bytes, value.payload, size);
    return STORE_FOUND;
}

bool store_save(const struct store *store, uint8_t key, uint8_t version, const void *bytes, size_t size) {
    struct value value;
    if (size > STORE_SIZE_MAX)
        return false;
    memcpy(value.payload, bytes, size);
    return save(store, key, version, &value, size);
}

static struct store_pair pair_at(const struct value *value, size_t index) {
    struct store_pair pair;
    const uint8_t *at = value->payload + index * PAIR_SIZE;
    memcpy(&pair.number, at, sizeof pair.number);
    memcpy(&pair.value, at + sizeof pair.number, sizeof pair.value);
    return pair;
}

static size_t put_pairs(struct value *value, const struct store_pair *pairs, size_t count) {
    uint8_t *at = value->payload;
    for (const struct store_pair *pair = pairs; pair < pairs + count; pair++, at += PAIR_SIZE) {
        memcpy(at, &pair->number, sizeof pair->number);
        memcpy(at + sizeof pair->number, &pair->value, sizeof pair->value);
    }
    return count * PAIR_SIZE;
}

size_t store_pack(uint8_t *image, uint8_t version, const struct store_pair *pairs, size_t count) {
    struct value value;
    seal(&value, version, put_pairs(&value, pairs, count));
    memcpy(image, &value, sizeof value.head + value.head.count);
    return sizeof value.head + value.head.count;
}

size_t store_unpack(const uint8_t *image, size_t size, uint8_t version, struct store_pair *pairs) {
    struct value value;
    if (size > sizeof value)
        return 0;
    memcpy(&value, image, size);
    if (!is_sound(&value, size, version) || value.head.count > SETTINGS_COUNT * PAIR_SIZE)
        return 0;
    for (size_t index = 0; index < value.head.count / PAIR_SIZE; index++)
        pairs[index] = pair_at(&value, index);
    return value.head.count / PAIR_SIZE;
}

/* One pass over the pairs. @param homing  only $22, or all but $22 */
static bool take_pairs(const struct value *value, bool homing, struct settings *settings,
                       uint8_t axis_count) {
    for (size_t index = 0; index < value->head.count / PAIR_SIZE; index++) {
        struct store_pair pair = pair_at(value, index);
        double present;
        uint8_t decimals;
        bool known = settings_get(settings, pair.number, axis_count, &present, &decimals);
        if (!known || (pair.number == HOMING_NUMBER) != homing || present == (double)pair.value)
            continue; /* a board may begin with a value that nobody can type */
        if (settings_set(settings, pair.number, (double)pair.value, axis_count) != STATUS_OK)
            return false;
    }
    return true;
}

enum store_result store_load_settings(const struct store *store, uint8_t key, uint8_t version,
                                      struct settings *settings, uint8_t axis_count) {
    struct value value;
    struct settings next = *settings;
    enum store_result result = load(store, key, version, &value);
    if (result != STORE_FOUND)
        return result;
    if (!take_pairs(&value, true, &next, axis_count) || !take_pairs(&value, false, &next, axis_count))
        return STORE_DAMAGED;
    *settings = next;
    return STORE_FOUND;
}

bool store_save_settings(const struct store *store, uint8_t key, uint8_t version,
                         const struct settings *settings) {
    struct value value;
    struct store_pair pairs[SETTINGS_COUNT];
    size_t count = 0;
    uint16_t number = SETTINGS_BEGIN;
    while (settings_next(&number, AXIS_COUNT)) {
        double read;
        uint8_t decimals;
        if (settings_get(settings, number, AXIS_COUNT, &read, &decimals))
            pairs[count++] = (struct store_pair){.number = number, .value = (float)read};
    }
    return save(store, key, version, &value, put_pairs(&value, pairs, count));
}
