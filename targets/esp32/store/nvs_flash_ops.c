/* SPDX-License-Identifier: MIT */
#include "store/nvs_flash_ops.h"

#include "nvs.h"
#include "nvs_flash.h"

#include <string.h>

static nvs_handle_t handle;

/* NVS has no floats: they are stored as u32 with the same bits (nvs_store.c). */
static bool get(void *ctx, const char *key, enum nvs_type type, uint32_t *value) {
    uint8_t u8 = 0;
    uint16_t u16 = 0;
    (void)ctx;
    switch (type) {
    case NVS_U8:
        if (nvs_get_u8(handle, key, &u8) != ESP_OK)
            return false;
        *value = u8;
        return true;
    case NVS_U16:
        if (nvs_get_u16(handle, key, &u16) != ESP_OK)
            return false;
        *value = u16;
        return true;
    case NVS_FLOAT:
    default:
        return nvs_get_u32(handle, key, value) == ESP_OK;
    }
}

static bool commit(esp_err_t error) {
    return error == ESP_OK && nvs_commit(handle) == ESP_OK;
}

static bool set(void *ctx, const char *key, enum nvs_type type, uint32_t value) {
    (void)ctx;
    switch (type) {
    case NVS_U8:
        return commit(nvs_set_u8(handle, key, (uint8_t)value));
    case NVS_U16:
        return commit(nvs_set_u16(handle, key, (uint16_t)value));
    case NVS_FLOAT:
    default:
        return commit(nvs_set_u32(handle, key, value));
    }
}

static size_t get_blob(void *ctx, const char *key, void *bytes, size_t size) {
    (void)ctx;
    return nvs_get_blob(handle, key, bytes, &size) == ESP_OK ? size : 0;
}

static bool set_blob(void *ctx, const char *key, const void *bytes, size_t count) {
    (void)ctx;
    return commit(nvs_set_blob(handle, key, bytes, count));
}

static bool erase(void *ctx, const char *key) {
    (void)ctx;
    return commit(nvs_erase_key(handle, key));
}

static size_t get_text(void *ctx, const char *key, char *text, size_t size) {
    (void)ctx;
    return nvs_get_str(handle, key, text, &size) == ESP_OK ? strlen(text) : 0;
}

static bool set_text(void *ctx, const char *key, const char *text) {
    (void)ctx;
    return commit(nvs_set_str(handle, key, text));
}

enum nvs_start nvs_flash_ops_open(struct nvs_store *store) {
    static const struct nvs_ops ops = {.get = get,
                                       .set = set,
                                       .get_blob = get_blob,
                                       .set_blob = set_blob,
                                       .erase = erase,
                                       .get_text = get_text,
                                       .set_text = set_text};
    enum nvs_start start = NVS_START_GOOD;
    esp_err_t error = nvs_flash_init();
    /* ESP-IDF's documented way out of both. firmware_start_machine() reports it. */
    if (error == ESP_ERR_NVS_NO_FREE_PAGES || error == ESP_ERR_NVS_NEW_VERSION_FOUND) {
        start = NVS_START_ERASED;
        error = nvs_flash_erase() == ESP_OK ? nvs_flash_init() : ESP_FAIL;
    }
    if (error != ESP_OK || nvs_open("wificnc", NVS_READWRITE, &handle) != ESP_OK)
        return NVS_START_FAILED;
    *store = (struct nvs_store){.ops = &ops};
    return start;
}

enum nvs_text nvs_flash_ops_find_text(const struct nvs_store *store, const char *key, char *text,
                                      size_t size) {
    esp_err_t error = store->ops != NULL ? nvs_get_str(handle, key, text, &size) : ESP_FAIL;
    if (error == ESP_OK)
        return NVS_TEXT_GOOD;
    return error == ESP_ERR_NVS_NOT_FOUND ? NVS_TEXT_NONE : NVS_TEXT_UNREADABLE;
}

size_t nvs_flash_ops_get_text(const struct nvs_store *store, const char *key, char *text, size_t size) {
    return nvs_flash_ops_find_text(store, key, text, size) == NVS_TEXT_GOOD ? strlen(text) : 0;
}

bool nvs_flash_ops_set_text(const struct nvs_store *store, const char *key, const char *text) {
    return store->ops != NULL && commit(nvs_set_str(handle, key, text));
}
