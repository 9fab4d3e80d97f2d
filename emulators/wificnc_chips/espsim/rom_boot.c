/* SPDX-License-Identifier: MIT
 * Functions of the S3's boot ROM that ESP-IDF's second-stage bootloader calls: SHA-256, erases and writes of
 * the flash chip (headers rom/sha.h, rom/spi_flash.h). */
#include "base/sha256.h"
#include "rom.h"

enum { TYPE = 4, STATE = 8, SHA2_256 = 2 }; /* SHA_CTX; its buffers keep our state */
enum { WRITE_ENABLE = 0x06, PAGE_PROGRAM = 0x02, SECTOR_ERASE = 0x20, SECTOR = 4096, PAGE_BYTES = 256 };

static bool read_state(struct esp *esp, uint32_t context, struct sha256 *sha) {
    if (es_read(esp, context + STATE, (uint8_t *)sha, sizeof *sha))
        return true;
    chip_fault(esp, "the boot ROM is to use a context of SHA at %08x, where no memory is", context);
    return false;
}

/* @return 0: done */
uint32_t rom_sha_init(struct esp *esp, uint32_t context, uint32_t type) {
    struct sha256 sha;
    if (type != SHA2_256 || !read_state(esp, context, &sha)) {
        chip_fault(esp, "the boot ROM's SHA of type %u is not emulated: it has SHA-256 alone", type);
        return 1;
    }
    sha256_begin(&sha);
    bus_store(esp, context + TYPE, type, 4);
    (void)es_write(esp, context + STATE, (const uint8_t *)&sha, sizeof sha);
    return 0;
}

void rom_sha_update(struct esp *esp, uint32_t context, uint32_t from, uint32_t count) {
    struct sha256 sha;
    if (!read_state(esp, context, &sha))
        return;
    for (uint32_t i = 0; i < count && esp->stop != ES_FAULT; i++) {
        const uint8_t byte = (uint8_t)bus_load(esp, from + i, 1);
        sha256_add(&sha, &byte, 1);
    }
    (void)es_write(esp, context + STATE, (const uint8_t *)&sha, sizeof sha);
}

uint32_t rom_sha_finish(struct esp *esp, uint32_t context, uint32_t to) {
    struct sha256 sha;
    uint8_t digest[SHA256_SIZE];
    if (!read_state(esp, context, &sha))
        return 1;
    sha256_end(&sha, digest);
    for (uint32_t i = 0; i < SHA256_SIZE; i++)
        bus_store(esp, to + i, digest[i], 1);
    return 0;
}

/* It waits until the flash chip is done. */
static void do_and_wait(struct esp *esp, const struct flash_command *command) {
    flash_do(esp, &(struct flash_command){.code = WRITE_ENABLE});
    flash_do(esp, command);
    esp->cycles += flash_busy_cycles(esp);
}

uint32_t rom_flash_erase_sector(struct esp *esp, uint32_t sector) {
    do_and_wait(esp, &(struct flash_command){.code = SECTOR_ERASE, .address = sector * SECTOR});
    return 0;
}

/* A page after the other. */
uint32_t rom_flash_write(struct esp *esp, uint32_t to, uint32_t from, uint32_t count) {
    uint8_t bytes[PAGE_BYTES];
    for (uint32_t done = 0, size; done < count && esp->stop == ES_TIME; done += size) {
        const uint32_t room = PAGE_BYTES - (to + done) % PAGE_BYTES;
        size = count - done < room ? count - done : room;
        for (uint32_t i = 0; i < size; i++)
            bytes[i] = (uint8_t)bus_load(esp, from + done + i, 1);
        do_and_wait(esp, &(struct flash_command){
                             .code = PAGE_PROGRAM, .address = to + done, .out = bytes, .out_count = size});
    }
    return 0;
}
