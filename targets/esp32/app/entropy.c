/* SPDX-License-Identifier: MIT */
#include "app/entropy.h"

#include "base/sha256.h"

#include "bootloader_random.h"
#include "esp_random.h"

#include <string.h>

static struct {
    uint8_t seed[SHA256_SIZE];
    uint32_t blocks; /* drawn so far: never the same one twice */
} entropy;

void entropy_start(void) {
    bootloader_random_enable();
    esp_fill_random(entropy.seed, sizeof entropy.seed);
    bootloader_random_disable();
}

void entropy_fill(void *bytes, size_t count) {
    uint8_t block[SHA256_SIZE], *to = bytes;
    while (count > 0) {
        const uint32_t number = __atomic_fetch_add(&entropy.blocks, 1, __ATOMIC_RELAXED);
        sha256_hmac(entropy.seed, sizeof entropy.seed, &number, sizeof number, block);
        const size_t piece = count < sizeof block ? count : sizeof block;
        memcpy(to, block, piece);
        to += piece;
        count -= piece;
    }
    memset(block, 0, sizeof block);
}
