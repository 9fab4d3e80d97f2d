/* SPDX-License-Identifier: MIT */
#include "net/ota_flash.h"

#include "signing_key.h"

#include "esp_app_desc.h"
#include "esp_ota_ops.h"
#include "esp_partition.h"

#include <stdio.h>

static struct {
    const esp_partition_t *slot;
    esp_ota_handle_t handle;
} update;

static const char *begin(void *ctx, size_t size) {
    const struct ota_flash *flash = ctx;
    update.slot = esp_ota_get_next_update_partition(NULL);
    if (update.slot == NULL)
        return "the flash has no second slot: update over USB";
    if (size > update.slot->size)
        return "the image is larger than its slot";
    if (ota_flash_is_on_trial())
        return "the firmware that runs is on trial: it is kept 30 s after its start, and can be replaced "
               "then";
    const char *why = flash->lock(flash->ctx);
    if (why != NULL)
        return why;
    /* Erased piece by piece, as it is written: all in one step takes seconds. */
    if (esp_ota_begin(update.slot, OTA_WITH_SEQUENTIAL_WRITES, &update.handle) == ESP_OK)
        return NULL;
    flash->unlock(flash->ctx);
    return "the slot cannot be written";
}

static bool is_signed(void *ctx, const uint8_t digest[SHA256_SIZE], const uint8_t signature[SIGNATURE_SIZE]) {
    static const uint8_t key[SIGNATURE_KEY_SIZE] = {SIGNING_KEY};
    (void)ctx;
    return signature_is_good(key, digest, signature);
}

static const char *write_flash(void *ctx, const uint8_t *bytes, size_t count) {
    (void)ctx;
    return esp_ota_write(update.handle, bytes, count) == ESP_OK ? NULL : "the flash cannot be written";
}

static const char *end(void *ctx) {
    const struct ota_flash *flash = ctx;
    /* Before anything can fail: an update that goes wrong must not leave the machine locked. */
    flash->unlock(flash->ctx);
    if (esp_ota_end(update.handle) != ESP_OK)
        return "the image is not a bootable firmware";
    return esp_ota_set_boot_partition(update.slot) == ESP_OK ? NULL : "cannot select the new slot";
}

static void abort_it(void *ctx) {
    const struct ota_flash *flash = ctx;
    (void)esp_ota_abort(update.handle);
    flash->unlock(flash->ctx);
}

const struct ota_ops ota_flash_ops = {
    .begin = begin, .is_signed = is_signed, .write = write_flash, .end = end, .abort = abort_it};

const char *ota_flash_digest(void) {
    static char digest[OTA_DIGEST_DIGITS + 1];
    const uint8_t *sha256 = esp_app_get_description()->app_elf_sha256;
    for (size_t i = 0; i < OTA_DIGEST_DIGITS / 2; i++)
        snprintf(digest + 2 * i, 3, "%02x", sha256[i]);
    return digest;
}

bool ota_flash_is_on_trial(void) {
    esp_ota_img_states_t state;
    return esp_ota_get_state_partition(esp_ota_get_running_partition(), &state) == ESP_OK &&
           state == ESP_OTA_IMG_PENDING_VERIFY;
}

void ota_flash_revert(void) {
    (void)esp_ota_mark_app_invalid_rollback_and_reboot();
}

void ota_flash_confirm(void) {
    (void)esp_ota_mark_app_valid_cancel_rollback();
}
