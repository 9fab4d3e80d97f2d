/* SPDX-License-Identifier: MIT
 * Random bytes of the ESP32: drawn only while the entropy source runs, once, and expanded from there. */
#include "app/entropy.h"
#include "base/sha256.h"
#include "check.h"

#include "bootloader_random.h"
#include "esp_random.h"

#include <string.h>

static bool runs;
static unsigned draws, starts;

void bootloader_random_enable(void) {
    CHECK(!runs);
    runs = true;
    starts++;
}
void bootloader_random_disable(void) {
    CHECK(runs);
    runs = false;
}
void esp_fill_random(void *bytes, size_t count) {
    CHECK(runs);
    CHECK(count >= 32);
    memset(bytes, (int)++draws, count);
}

/* The stream from block `number` on. */
static void expected(uint8_t seed, uint32_t number, uint8_t digest[SHA256_SIZE]) {
    uint8_t key[SHA256_SIZE];
    memset(key, seed, sizeof key);
    sha256_hmac(key, sizeof key, &number, sizeof number, digest);
}

int main(void) {
    uint8_t got[80] = {0}, want[SHA256_SIZE], again[16];
    entropy_start();
    CHECK(starts == 1 && draws == 1 && !runs);
    entropy_fill(got, 70);
    for (uint32_t block = 0; block < 3; block++) {
        expected(1, block, want);
        CHECK(memcmp(got + block * SHA256_SIZE, want, block < 2 ? SHA256_SIZE : 6) == 0);
    }
    CHECK(got[70] == 0);
    expected(1, 3, want); /* no block is used twice, nor the rest of one */
    entropy_fill(again, sizeof again);
    CHECK(memcmp(again, want, sizeof again) == 0);
    entropy_fill(again, 0);
    CHECK(draws == 1 && starts == 1);
    return report();
}
