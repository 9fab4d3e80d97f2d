/* SPDX-License-Identifier: MIT
 * MD5 and CRC-32, of partition tables, otadata, and the boot ROM. */
#ifndef WIFICNC_ESPSIM_DIGEST_H
#define WIFICNC_ESPSIM_DIGEST_H

#include <stddef.h>
#include <stdint.h>

/** The boot ROM's struct MD5Context has as many bytes: a program's memory may hold one. */
struct md5 {
    uint32_t state[4];
    uint32_t count, unused;
    uint8_t bytes[64];
};
void md5_begin(struct md5 *md5);
void md5_add(struct md5 *md5, const uint8_t *bytes, size_t count);
void md5_end(struct md5 *md5, uint8_t digest[16]);

/** esp_rom_crc32_le(). */
uint32_t crc32_rom(uint32_t crc, const uint8_t *bytes, size_t count);

#endif
