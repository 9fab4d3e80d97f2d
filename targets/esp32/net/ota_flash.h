/* SPDX-License-Identifier: MIT
 * struct ota_ops over ESP-IDF's two application slots. [task] */
#ifndef WIFICNC_ESP32_OTA_FLASH_H
#define WIFICNC_ESP32_OTA_FLASH_H

#include "net/ota.h"

/** Whoever must agree, and is held still meanwhile. */
struct ota_flash {
    /** @return NULL: continue, and stay locked until unlock(); or why not now */
    const char *(*lock)(void *ctx);
    void (*unlock)(void *ctx);
    void *ctx;
};

/** Their ctx is a struct ota_flash. */
extern const struct ota_ops ota_flash_ops;

/** Of the firmware that runs: the first OTA_DIGEST_DIGITS hex digits of the SHA-256 of its ELF file, which is
 * in every image (esp_app_desc_t, at 176 of the file). [start: the first call; then any task] */
const char *ota_flash_digest(void);

/** The image that runs was installed by an update and is not confirmed yet. */
bool ota_flash_is_on_trial(void);

/** The image that runs has proved itself: the bootloader will not go back to the one before. */
void ota_flash_confirm(void);

/** Restart into the image before. Returns only where there is none. */
void ota_flash_revert(void);

#endif
