/* SPDX-License-Identifier: MIT */
#include "store/nvs_store.h"

#include "settings/store.h"

#include <math.h>
#include <string.h>

static const char journal[] = "journal", stored[] = "stored";

/* Key "stored": keys of the core, and settings by number, one bit each. Firmware that knew no number above
 * 255 wrote a shorter list: the bits behind it are 0. */
enum { CORE_KEYS = 16, NUMBERS = 1024 };
_Static_assert((int)SETTINGS_NUMBER_MAX < (int)NUMBERS, "each setting has its bit");
struct stored_list {
    uint8_t core[CORE_KEYS / 8], settings[NUMBERS / 8];
};

/* Before each value in the journal. */
struct journal_head {
    uint8_t key, none;
    uint16_t count;
};
enum { JOURNAL_SIZE = STORE_BATCH_SIZE + STORE_BATCH_VALUES * (int)sizeof(struct journal_head) };

/* "kept002" and so on. */
struct blob_key {
    char text[8];
};

static struct blob_key blob_key(uint8_t key) {
    struct blob_key name = {.text = "kept"};
    name.text[4] = (char)('0' + key / 100);
    name.text[5] = (char)('0' + key / 10 % 10);
    name.text[6] = (char)('0' + key % 10);
    return name;
}

/* ---- what is stored ---- */

static struct stored_list read_list(const struct nvs_store *store) {
    struct stored_list list = {{0}, {0}};
    if (store->ops->get_blob(store->ctx, stored, &list, sizeof list) == 0)
        list = (struct stored_list){{0}, {0}};
    return list;
}

static bool is_listed(const uint8_t *bits, size_t index) {
    return (bits[index / 8] >> index % 8 & 1) != 0;
}

static void list(uint8_t *bits, size_t index) {
    bits[index / 8] |= (uint8_t)(1u << index % 8);
}

static bool write_list(const struct nvs_store *store, const struct stored_list *fresh) {
    struct stored_list before = read_list(store);
    return memcmp(&before, fresh, sizeof before) == 0 ||
           store->ops->set_blob(store->ctx, stored, fresh, sizeof *fresh);
}

static bool list_core_key(const struct nvs_store *store, uint8_t key) {
    struct stored_list fresh = read_list(store);
    list(fresh.core, key);
    return write_list(store, &fresh);
}

/* All settings are stored in one step. */
static bool list_settings(const struct nvs_store *store) {
    struct stored_list fresh = read_list(store);
    for (size_t i = 0; i < SETTINGS_COUNT; i++)
        list(fresh.settings, nvs_keys[i].number);
    return write_list(store, &fresh);
}

/* ---- one setting ---- */

static uint32_t bits_of(const struct nvs_key *row, float value) {
    uint32_t bits;
    if (row->type != NVS_FLOAT)
        return (uint32_t)value;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static float value_of(const struct nvs_key *row, uint32_t bits) {
    float value;
    if (row->type != NVS_FLOAT)
        return (float)bits;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static const struct nvs_key *find(uint16_t number) {
    for (size_t i = 0; i < SETTINGS_COUNT; i++)
        if (nvs_keys[i].number == number)
            return &nvs_keys[i];
    return NULL;
}

static bool is_kept(const struct nvs_store *store, const struct nvs_key *row, uint32_t bits) {
    uint32_t kept;
    return store->ops->get(store->ctx, row->key, (enum nvs_type)row->type, &kept) && kept == bits;
}

/* ---- all settings ---- */

static bool put(const struct nvs_store *store, const struct store_pair *pair) {
    const struct nvs_key *row = find(pair->number);
    uint32_t bits = row == NULL ? 0 : bits_of(row, pair->value);
    if (row == NULL || is_kept(store, row, bits))
        return true;
    return store->ops->set(store->ctx, row->key, (enum nvs_type)row->type, bits);
}

static bool put_all(const struct nvs_store *store, const struct store_pair *pairs, size_t count) {
    for (size_t i = 0; i < count; i++)
        if (!put(store, &pairs[i]))
            return false;
    return true;
}

static size_t changes(const struct nvs_store *store, const struct store_pair *pairs, size_t count) {
    size_t changed = 0;
    for (size_t i = 0; i < count; i++) {
        const struct nvs_key *row = find(pairs[i].number);
        changed += row != NULL && !is_kept(store, row, bits_of(row, pairs[i].value));
    }
    return changed;
}

static bool put_settings(const struct nvs_store *store, const void *image, size_t size) {
    struct store_pair pairs[SETTINGS_COUNT];
    size_t count = store_unpack(image, size, pairs);
    return count > 0 && put_all(store, pairs, count) && list_settings(store);
}

/* ---- several entries in one step ---- */

static bool put_value(const struct nvs_store *store, const struct hal_store_value *value) {
    if (value->key == STORE_KEY_SETTINGS)
        return put_settings(store, value->bytes, value->count);
    return store->ops->set_blob(store->ctx, blob_key(value->key).text, value->bytes, value->count) &&
           list_core_key(store, value->key);
}

/* What NVS keeps atomically by itself: a number. A blob it does not (ESP-IDF 5.5): when the power goes after
 * new data are written and before their index is, the next start takes the old data for a duplicate, and
 * loses both. */
static bool is_one_entry(const struct nvs_store *store, const struct hal_store_value *values, size_t count) {
    struct store_pair pairs[SETTINGS_COUNT];
    if (count != 1 || values->key != STORE_KEY_SETTINGS)
        return false;
    return changes(store, pairs, store_unpack(values->bytes, values->count, pairs)) <= 1;
}

static bool write_journal(const struct nvs_store *store, const struct hal_store_value *values, size_t count) {
    uint8_t bytes[JOURNAL_SIZE];
    size_t used = 0;
    for (size_t i = 0; i < count; i++) {
        const struct journal_head head = {.key = values[i].key, .count = (uint16_t)values[i].count};
        if (values[i].count > sizeof bytes - sizeof head ||
            used > sizeof bytes - sizeof head - values[i].count)
            return false;
        memcpy(bytes + used, &head, sizeof head);
        memcpy(bytes + used + sizeof head, values[i].bytes, values[i].count);
        used += sizeof head + values[i].count;
    }
    return store->ops->set_blob(store->ctx, journal, bytes, used);
}

/* All that the journal has, in place. @return false: something could not be written */
static bool carry_out(const struct nvs_store *store, const uint8_t *bytes, size_t size) {
    struct journal_head head;
    for (size_t at = 0; size - at > sizeof head; at += sizeof head + head.count) {
        memcpy(&head, bytes + at, sizeof head);
        if (head.count > size - at - sizeof head)
            return true; /* not by us: NVS checks its entries */
        const struct hal_store_value value = {
            .key = head.key, .bytes = bytes + at + sizeof head, .count = head.count};
        if (!put_value(store, &value))
            return false;
    }
    return true;
}

/* A power cut came between: what was to be saved is known whole. */
static void finish_journal(const struct nvs_store *store) {
    uint8_t bytes[JOURNAL_SIZE];
    size_t size = store->ops->get_blob(store->ctx, journal, bytes, sizeof bytes);
    if (size > 0 && carry_out(store, bytes, size))
        store->ops->erase(store->ctx, journal);
}

static size_t load_settings(const struct nvs_store *store, void *bytes, size_t size) {
    uint8_t image[STORE_IMAGE_MAX];
    struct store_pair pairs[SETTINGS_COUNT];
    size_t count = 0;
    const struct stored_list listed = read_list(store);
    for (size_t i = 0; i < SETTINGS_COUNT; i++) {
        const struct nvs_key *row = &nvs_keys[i];
        uint32_t bits;
        if (store->ops->get(store->ctx, row->key, (enum nvs_type)row->type, &bits))
            pairs[count++] = (struct store_pair){.number = row->number, .value = value_of(row, bits)};
        else if (is_listed(listed.settings, row->number))
            /* Stored, and dropped by NVS: no setting takes NaN, so that the core reports it as lost. */
            pairs[count++] = (struct store_pair){.number = row->number, .value = NAN};
    }
    if (count == 0)
        return 0;
    size_t made = store_pack(image, pairs, count);
    made = made < size ? made : size;
    memcpy(bytes, image, made);
    return made;
}

/* ---- hal_store ---- */

static size_t load(const void *ctx, uint8_t key, void *bytes, size_t size) {
    const struct nvs_store *store = ctx;
    finish_journal(store);
    if (key == STORE_KEY_SETTINGS)
        return load_settings(store, bytes, size);
    size_t count = store->ops->get_blob(store->ctx, blob_key(key).text, bytes, size);
    if (count == 0 && is_listed(read_list(store).core, key)) {
        /* It was stored and NVS has dropped it. One byte is no sound value, so that the core reports it as
         * damaged and not as absent. */
        *(uint8_t *)bytes = 0;
        return 1;
    }
    if (count > 0)
        (void)list_core_key(store, key); /* of a firmware that had no list, or a power cut came before it */
    return count;
}

static enum hal_store_state save(const void *ctx, const struct hal_store_value *values, size_t count) {
    const struct nvs_store *store = ctx;
    bool good;
    if (is_one_entry(store, values, count)) {
        good = put_value(store, values);
    } else {
        /* The journal is erased last. Until then a power cut leaves all that was to be written, and load()
         * finishes it. */
        good = write_journal(store, values, count);
        for (size_t i = 0; i < count; i++)
            good = good && put_value(store, &values[i]);
        good = good && store->ops->erase(store->ctx, journal);
    }
    return good ? HAL_STORE_DONE : HAL_STORE_FAILED;
}

/* NVS has dropped what is damaged. What is left of the settings is copied as one image; the other values are
 * replaced only by the user, one by one. */
static enum hal_store_state set_aside(const void *ctx) {
    const struct nvs_store *store = ctx;
    uint8_t image[STORE_IMAGE_MAX];
    size_t size = load_settings(store, image, sizeof image);
    bool copied = size > 0 && store->ops->set_blob(store->ctx, "aside", image, size);
    return copied ? HAL_STORE_DONE : HAL_STORE_FAILED;
}

const struct hal_store nvs_hal_store = {.load = load, .save = save, .set_aside = set_aside};
