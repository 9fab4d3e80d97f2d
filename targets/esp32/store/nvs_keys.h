/* SPDX-License-Identifier: MIT
 * Under which key, and as what, each setting lies in the ESP32's non-volatile storage. */
#ifndef WIFICNC_ESP32_NVS_KEYS_H
#define WIFICNC_ESP32_NVS_KEYS_H

#include "settings/settings_gen.h" // SETTINGS_COUNT

#include <stdint.h>

/** NVS knows no float: it lies there as a u32 with the same bits (IEEE 754). */
enum nvs_type { NVS_U8, NVS_U16, NVS_FLOAT };

struct nvs_key {
    uint16_t number; /* of $N */
    uint8_t type;    /* enum nvs_type */
    char key[16];    /* at most 15 characters */
};

/** Ascending by number. */
extern const struct nvs_key nvs_keys[SETTINGS_COUNT];

#endif
