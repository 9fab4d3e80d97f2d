/* SPDX-License-Identifier: MIT */
#include "store/nvs_store.h"

#include "settings/store.h"

#include <string.h>

static const char pending[] = "pending";

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

static bool save_settings(const struct nvs_store *store, const void *image, size_t size) {
    struct store_pair pairs[SETTINGS_COUNT];
    size_t count = store_unpack(image, size, STORE_VERSION, pairs);
    size_t changed = changes(store, pairs, count);
    if (count == 0)
        return false;
    if (changed <= 1)
        return put_all(store, pairs, count);
    return store->ops->set_blob(store->ctx, pending, image, size) && put_all(store, pairs, count) &&
           store->ops->erase(store->ctx, pending);
}

/* A power cut came between: what was to be saved is known whole. */
static void finish_pending(const struct nvs_store *store) {
    uint8_t image[STORE_IMAGE_MAX];
    struct store_pair pairs[SETTINGS_COUNT];
    size_t size = store->ops->get_blob(store->ctx, pending, image, sizeof image);
    if (size == 0)
        return;
    size_t count = store_unpack(image, size, STORE_VERSION, pairs);
    if (put_all(store, pairs, count))
        store->ops->erase(store->ctx, pending);
}

static size_t load_settings(const struct nvs_store *store, void *bytes, size_t size) {
    uint8_t image[STORE_IMAGE_MAX];
    struct store_pair pairs[SETTINGS_COUNT];
    size_t count = 0;
    finish_pending(store);
    for (size_t i = 0; i < SETTINGS_COUNT; i++) {
        const struct nvs_key *row = &nvs_keys[i];
        uint32_t bits;
        if (store->ops->get(store->ctx, row->key, (enum nvs_type)row->type, &bits))
            pairs[count++] = (struct store_pair){.number = row->number, .value = value_of(row, bits)};
    }
    if (count == 0)
        return 0;
    size_t made = store_pack(image, STORE_VERSION, pairs, count);
    made = made < size ? made : size;
    memcpy(bytes, image, made);
    return made;
}

/* ---- hal_store ---- */

static size_t load(const void *ctx, uint8_t key, void *bytes, size_t size) {
    const struct nvs_store *store = ctx;
    if (key == STORE_KEY_SETTINGS)
        return load_settings(store, bytes, size);
    return store->ops->get_blob(store->ctx, blob_key(key).text, bytes, size);
}

static bool save(const void *ctx, uint8_t key, const void *bytes, size_t count) {
    const struct nvs_store *store = ctx;
    if (key == STORE_KEY_SETTINGS)
        return save_settings(store, bytes, count);
    return store->ops->set_blob(store->ctx, blob_key(key).text, bytes, count);
}

const struct hal_store nvs_hal_store = {.load = load, .save = save};
