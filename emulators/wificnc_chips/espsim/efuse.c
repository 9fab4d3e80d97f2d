/* SPDX-License-Identifier: MIT
 * What the chip is, in its eFuses: the MAC address and the revision, 3.0 of the ESP32, 0.2 of the S3; no key,
 * no protection. And random numbers, the same in each run. */
#include "esp.h"

#include <string.h>

/* 02-...: an address that no maker has. */
static const uint8_t mac[6] = {0x02, 0x00, 0x00, 0x32, 0x00, 0x01};

/* As eFuses have it: CRC-8, polynomial 0x31, the lowest bit first. */
uint8_t efuse_crc8(const uint8_t *bytes, size_t count) {
    uint8_t crc = 0;
    for (size_t i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (unsigned bit = 0; bit < 8; bit++)
            crc = (uint8_t)(crc >> 1 ^ ((crc & 1) != 0 ? 0x8C : 0));
    }
    return crc;
}

enum {
    ESP32_MAC = 0x04,
    ESP32_REVISION1 = 0x0C,
    ESP32_REVISION2 = 0x14,
    ESP32_COMMAND = 0x104,
    ESP32_DATE = 0x1FC
};
enum { S3_MAC = 0x44, S3_SYS3 = 0x50, S3_COMMAND = 0x1D4 };

static void burn_esp32(uint32_t *word) {
    word[ESP32_MAC / 4] = (uint32_t)mac[2] << 24 | (uint32_t)mac[3] << 16 | (uint32_t)mac[4] << 8 | mac[5];
    word[ESP32_MAC / 4 + 1] = (uint32_t)efuse_crc8(mac, sizeof mac) << 16 | (uint32_t)mac[0] << 8 | mac[1];
    word[ESP32_REVISION1 / 4] = 1u << 15;
    word[ESP32_REVISION2 / 4] = 1u << 20;
}

static void burn_s3(uint32_t *word) {
    word[S3_MAC / 4] = (uint32_t)mac[2] << 24 | (uint32_t)mac[3] << 16 | (uint32_t)mac[4] << 8 | mac[5];
    word[S3_MAC / 4 + 1] = (uint32_t)mac[0] << 8 | mac[1];
    word[S3_SYS3 / 4] = 2u << 18;
}

static uint32_t load(struct esp *esp, uint32_t offset) {
    return esp->efuse[offset / 4];
}

/* Commands read the fuses again; none is burnt. */
static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    const bool is_command = offset == (esp->chip == ES_ESP32 ? ESP32_COMMAND : S3_COMMAND);
    if (is_command && (value & 2) != 0)
        chip_fault(esp, "an eFuse is burnt, which is not emulated");
    else if (!is_command && offset >= (esp->chip == ES_ESP32 ? 0xE8u : 0x1C8u))
        esp->efuse[offset / 4] = value;
}

static uint32_t random_load(struct esp *esp, uint32_t offset) {
    (void)offset;
    uint32_t x = esp->random;
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    return esp->random = x;
}

static void random_store(struct esp *esp, uint32_t offset, uint32_t value) {
    (void)esp;
    (void)offset;
    (void)value;
}

void efuse_create(struct esp *esp) {
    const bool is_s3 = esp->chip == ES_ESP32S3;
    memset(esp->efuse, 0, sizeof esp->efuse);
    if (is_s3)
        burn_s3(esp->efuse);
    else
        burn_esp32(esp->efuse);
    if (esp->random == 0)
        esp->random = 0x57694669;
    bus_add(esp,
            &(struct block){"eFuse", is_s3 ? 0x60007000 : 0x3FF5A000, 4 * EFUSE_WORDS, load, store, NULL});
    bus_add(esp, &(struct block){"RNG", is_s3 ? 0x6003507C : 0x3FF75144, 4, random_load, random_store, NULL});
}
