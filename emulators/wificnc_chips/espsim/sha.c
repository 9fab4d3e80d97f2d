/* SPDX-License-Identifier: MIT
 * The SHA accelerator, for SHA-256: block by block, without DMA. Other digests stop the chip. */
#include "base/sha256.h"
#include "esp.h"

#include <string.h>

enum { WORDS = SHA256_BLOCK / 4, STATE = 8 };

/* A block of words whose first byte is the highest. */
static void add(struct esp *esp, const uint32_t word[WORDS]) {
    struct sha256 sha = {.bytes = 0};
    uint8_t block[SHA256_BLOCK];
    for (unsigned i = 0; i < WORDS; i++)
        for (unsigned byte = 0; byte < 4; byte++)
            block[4 * i + byte] = (uint8_t)(word[i] >> (24 - 8 * byte));
    memcpy(sha.state, esp->sha.state, sizeof sha.state);
    sha256_add(&sha, block, sizeof block);
    memcpy(esp->sha.state, sha.state, sizeof sha.state);
}

static void begin(struct esp *esp) {
    struct sha256 sha;
    sha256_begin(&sha);
    memcpy(esp->sha.state, sha.state, sizeof sha.state);
}

/* ---- the ESP32: a text of 32 words, and for each digest START, CONTINUE, LOAD, BUSY ---- */

enum { START_1 = 0x80, START_256 = 0x90, CONTINUE_256 = 0x94, LOAD_256 = 0x98, ESP32_SIZE = 0xC0 };

static uint32_t esp32_load(struct esp *esp, uint32_t offset) {
    return offset < START_1 ? esp->sha.text[offset / 4] : 0;
}

static void esp32_store(struct esp *esp, uint32_t offset, uint32_t value) {
    if (offset < START_1)
        esp->sha.text[offset / 4] = value;
    else if (offset == START_256 || offset == CONTINUE_256) {
        if (offset == START_256)
            begin(esp);
        add(esp, esp->sha.text);
    } else if (offset == LOAD_256)
        memcpy(esp->sha.text, esp->sha.state, sizeof esp->sha.state);
    else
        chip_fault(esp, "the register %02x of the SHA accelerator is not emulated: it has SHA-256 alone",
                   offset);
}

/* ---- the S3: mode, state and text, whose words lie as bytes do ---- */

enum {
    MODE = 0x00,
    START = 0x10,
    CONTINUE = 0x14,
    BUSY = 0x18,
    DATE = 0x2C,
    H = 0x40,
    M = 0x80,
    S3_SIZE = 0x100
};
enum { MODE_SHA256 = 2 };

static uint32_t s3_load(struct esp *esp, uint32_t offset) {
    if (offset == MODE)
        return esp->sha.mode;
    if (offset - H < 4 * STATE)
        return __builtin_bswap32(esp->sha.state[(offset - H) / 4]);
    return offset >= M ? esp->sha.text[(offset - M) / 4] : 0;
}

static void s3_add(struct esp *esp, bool first) {
    uint32_t word[WORDS];
    for (unsigned i = 0; i < WORDS; i++)
        word[i] = __builtin_bswap32(esp->sha.text[i]);
    if (esp->sha.mode != MODE_SHA256)
        chip_fault(esp, "the mode %u of the SHA accelerator is not emulated: it has SHA-256 alone",
                   esp->sha.mode);
    if (first)
        begin(esp);
    add(esp, word);
}

static void s3_store(struct esp *esp, uint32_t offset, uint32_t value) {
    if (offset == MODE)
        esp->sha.mode = value;
    else if (offset == START || offset == CONTINUE)
        s3_add(esp, offset == START);
    else if (offset - H < 4 * STATE)
        esp->sha.state[(offset - H) / 4] = __builtin_bswap32(value);
    else if (offset >= M && offset - M < SHA256_BLOCK)
        esp->sha.text[(offset - M) / 4] = value;
    else if (offset != BUSY && offset != DATE)
        chip_fault(esp, "the register %02x of the SHA accelerator is not emulated: it has no DMA", offset);
}

void sha_create(struct esp *esp) {
    memset(&esp->sha, 0, sizeof esp->sha);
    if (esp->chip == ES_ESP32S3)
        bus_add(esp, &(struct block){"SHA", 0x6003B000, S3_SIZE, s3_load, s3_store, NULL});
    else
        bus_add(esp, &(struct block){"SHA", 0x3FF03000, ESP32_SIZE, esp32_load, esp32_store, NULL});
}
