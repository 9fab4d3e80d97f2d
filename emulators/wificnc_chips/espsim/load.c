/* SPDX-License-Identifier: MIT
 * Programs: ELF files, and application images of ESP-IDF (esptool's documentation, Firmware Image Format). A
 * file is looked at whole before any of it is loaded. */
#include "base/sha256.h"
#include "esp.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MACHINE_XTENSA = 94, SEGMENT_LOAD = 1, SECTION_SYMBOLS = 2, SYMBOL_MAX = 128 };
enum { HEADER = 24, IMAGE_MAGIC = 0xE9, CHECKSUM_START = 0xEF, HASH = 32 };
enum { SIGNATURE_MAGIC = 0xE7, SIGNATURE_ALIGNMENT = 4096, APP_PLACE = 0x10000 };

const char *const chip_names[] = {"ESP32", "ESP32-S3"};
static const unsigned chip_ids[] = {0, 9};

static uint32_t word(const uint8_t *at) {
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static uint16_t half(const uint8_t *at) {
    return (uint16_t)(at[0] | at[1] << 8);
}

static bool fits(struct esp *esp, const struct piece *piece, size_t size) {
    if (piece->at > size || piece->count > size - piece->at) {
        chip_fault(esp, "the file ends in the middle of the segment for %08x", piece->address);
        return false;
    }
    if (mmu_has(esp, piece->address))
        return true;
    if (piece->count != 0 && !bus_has(esp, piece->address, piece->count)) {
        chip_fault(esp, "the %s has no memory for %zu bytes at %08x", chip_names[esp->chip], piece->count,
                   piece->address);
        return false;
    }
    return true;
}

static void start(struct esp *esp, const uint8_t *bytes, const struct piece *pieces, unsigned count,
                  uint32_t entry) {
    cpu_reset(esp, esp->cpu);
    for (unsigned i = 0; i < count; i++)
        if (pieces[i].count != 0)
            (void)es_write(esp, pieces[i].address, bytes + pieces[i].at, pieces[i].count);
    esp->cpu->pc = entry;
    esp->cpu->ps = PS_WOE | PS_UM;
    esp->cpu->a[1] = esp->memory[0].base + esp->memory[0].size - 16; /* end of data RAM */
    chip_look(esp);
}

/* ---- ELF ---- */

static void add_symbol(struct esp *esp, const char *name, const uint8_t *entry) {
    const unsigned type = entry[12] & 15;
    char *kept = malloc(SYMBOL_MAX);
    if (kept == NULL ||
        !chip_grow(&esp->symbols, &esp->symbol_room, esp->symbol_count + 1, sizeof *esp->symbols))
        abort();
    strncpy(kept, name, SYMBOL_MAX - 1);
    kept[SYMBOL_MAX - 1] = '\0';
    esp->symbols[esp->symbol_count++] =
        (struct symbol){.address = word(entry + 4), .size = type == 2 ? word(entry + 8) : 0, .name = kept};
}

static void load_symbols(struct esp *esp, const uint8_t *bytes, size_t size, const uint8_t *table,
                         const uint8_t *strings) {
    const size_t at = word(table + 16), count = word(table + 20), names = word(strings + 16),
                 names_size = word(strings + 20);
    if (at > size || count > size - at || names > size || names_size > size - names || names_size == 0 ||
        bytes[names + names_size - 1] != '\0')
        return;
    for (size_t entry = at; entry + 16 <= at + count; entry += 16)
        if (word(bytes + entry) != 0 && word(bytes + entry) < names_size)
            add_symbol(esp, (const char *)bytes + names + word(bytes + entry), bytes + entry);
}

static void find_symbols(struct esp *esp, const uint8_t *bytes, size_t size) {
    const size_t sections = word(bytes + 32), count = half(bytes + 48);
    for (size_t i = 0; i < count && sections <= size && (i + 1) * 40 <= size - sections; i++) {
        const uint8_t *section = bytes + sections + 40 * i;
        const size_t link = word(section + 24);
        if (word(section + 4) == SECTION_SYMBOLS && link < count && (link + 1) * 40 <= size - sections)
            load_symbols(esp, bytes, size, section, bytes + sections + 40 * link);
    }
}

static bool is_elf(const uint8_t *bytes, size_t size) {
    static const uint8_t magic[4] = {0x7F, 'E', 'L', 'F'};
    return size >= 4 && memcmp(bytes, magic, sizeof magic) == 0;
}

static bool is_program(const uint8_t *bytes, size_t size) {
    return size >= 52 && bytes[4] == 1 && bytes[5] == 1 && half(bytes + 18) == MACHINE_XTENSA;
}

static bool load_elf(struct esp *esp, const uint8_t *bytes, size_t size) {
    struct piece pieces[SEGMENTS_MAX];
    unsigned found = 0;
    if (!is_program(bytes, size)) {
        chip_fault(esp, "this ELF file is not a program for Xtensa");
        return false;
    }
    const size_t headers = word(bytes + 28), count = half(bytes + 44);
    for (size_t i = 0; i < count; i++) {
        const uint8_t *header = bytes + headers + 32 * i;
        if (headers > size || (i + 1) * 32 > size - headers) {
            chip_fault(esp, "the file ends in its program headers");
            return false;
        }
        if (word(header) != SEGMENT_LOAD || word(header + 16) == 0)
            continue;
        const struct piece piece = {word(header + 8), word(header + 4), word(header + 16)};
        if (found == SEGMENTS_MAX)
            chip_fault(esp, "the program has more than %d segments", SEGMENTS_MAX);
        if (found == SEGMENTS_MAX || !fits(esp, &piece, size))
            return false;
        pieces[found++] = piece;
    }
    find_symbols(esp, bytes, size);
    start(esp, bytes, pieces, found, word(bytes + 24));
    return true;
}

/* ---- images ---- */

/* @param text  room for one that has no name here */
static const char *name_of_chip(unsigned id, char text[24]) {
    static const char *const names[] = {[0] = "ESP32",     [2] = "ESP32-S2",  [5] = "ESP32-C3",
                                        [9] = "ESP32-S3",  [12] = "ESP32-C2", [13] = "ESP32-C6",
                                        [16] = "ESP32-H2", [18] = "ESP32-P4"};
    if (id < sizeof names / sizeof names[0] && names[id] != NULL)
        return names[id];
    snprintf(text, 24, "chip with number %u", id);
    return text;
}

static bool is_header_right(struct esp *esp, const uint8_t *bytes, size_t size) {
    char other[24];
    if (size == 0 || bytes[0] != IMAGE_MAGIC)
        chip_fault(esp,
                   "this is neither an ELF file nor an image of ESP-IDF (its first byte is %02x, not e9); "
                   "encrypted images cannot be run",
                   size == 0 ? 0 : bytes[0]);
    else if (size < HEADER)
        chip_fault(esp, "the image ends in its header");
    else if (half(bytes + 12) != chip_ids[esp->chip])
        chip_fault(esp, "this image is for the %s, not for the %s", name_of_chip(half(bytes + 12), other),
                   chip_names[esp->chip]);
    else if (bytes[1] == 0 || bytes[1] > SEGMENTS_MAX)
        chip_fault(esp, "the image is damaged: it has %u segments (1 to %d)", bytes[1], SEGMENTS_MAX);
    else
        return true;
    return false;
}

static bool has_hash(const uint8_t *bytes, size_t size, const uint8_t hash[HASH]) {
    struct sha256 sha;
    uint8_t digest[SHA256_SIZE];
    sha256_begin(&sha);
    sha256_add(&sha, bytes, size);
    sha256_end(&sha, digest);
    return memcmp(hash, digest, HASH) == 0;
}

/* Checksum and hash. @param end  of the last segment */
static bool is_whole(struct esp *esp, const uint8_t *bytes, size_t size, size_t end, uint8_t checksum) {
    const size_t checksum_at = end | 15, hashed = checksum_at + 1, all = hashed + (bytes[23] == 1 ? HASH : 0);
    const size_t signature = (all + SIGNATURE_ALIGNMENT - 1) & ~(size_t)(SIGNATURE_ALIGNMENT - 1);
    if (size < all)
        chip_fault(esp, "the image is damaged: it ends after %zu of %zu bytes", size, all);
    else if (bytes[checksum_at] != checksum)
        chip_fault(esp, "the image is damaged: its checksum is %02x, not %02x", checksum, bytes[checksum_at]);
    else if (signature < size && bytes[signature] == SIGNATURE_MAGIC)
        chip_fault(esp, "this image is signed for secure boot, which is not emulated; load the unsigned one");
    else if (bytes[23] == 1 && !has_hash(bytes, hashed, bytes + hashed))
        chip_fault(esp, "the image is damaged: its SHA-256 is another one");
    else
        return true;
    return false;
}

bool image_read(struct esp *esp, const uint8_t *bytes, size_t size, struct image *image) {
    uint8_t checksum = CHECKSUM_START;
    size_t at = HEADER;
    *image = (struct image){0};
    if (!is_header_right(esp, bytes, size))
        return false;
    for (unsigned i = 0; i < bytes[1]; i++) {
        if (size - at < 8) {
            chip_fault(esp, "the image is damaged: it ends in the header of segment %u", i);
            return false;
        }
        const struct piece piece = {word(bytes + at), at + 8, word(bytes + at + 4)};
        const bool is_padding = piece.address == 0;
        if (is_padding ? piece.count > size - piece.at : !fits(esp, &piece, size)) {
            chip_fault(esp, "the image is damaged: it ends in segment %u", i);
            return false;
        }
        for (size_t n = 0; n < piece.count; n++)
            checksum ^= bytes[piece.at + n];
        if (!is_padding)
            image->piece[image->count++] = piece;
        at = piece.at + piece.count;
    }
    image->entry = word(bytes + 4);
    image->size = (at | 15) + 1 + (bytes[23] == 1 ? HASH : 0);
    return is_whole(esp, bytes, size, at, checksum);
}

static bool put_into_flash(struct esp *esp, const uint8_t *bytes, size_t size) {
    if (es_flash_write(esp, APP_PLACE, bytes, size))
        return true;
    chip_fault(esp, "the image has %zu bytes, which its flash of %u MB has no room for", size,
               esp->flash.size >> 20);
    return false;
}

/* An application alone: where ESP-IDF has its first one by default, without a partition table. */
static bool load_image(struct esp *esp, const uint8_t *bytes, size_t size) {
    struct image image;
    if (!image_read(esp, bytes, size, &image))
        return false;
    if (size > image.size) {
        chip_fault(esp,
                   "%zu bytes follow the image's end: a signed image or parts of a flash; load the "
                   "application's image alone",
                   size - image.size);
        return false;
    }
    if (!boot_can_map(esp, &image, APP_PLACE))
        return false;
    return flash_create(esp, boot_flash_size(bytes)) && put_into_flash(esp, bytes, size) &&
           boot_start(esp, &image, APP_PLACE);
}

bool es_load(struct esp *esp, const uint8_t *bytes, size_t count) {
    esp->stop = ES_TIME;
    esp->fault[0] = '\0';
    if (is_elf(bytes, count))
        return load_elf(esp, bytes, count);
    if (boot_is_merged(bytes, count))
        return boot_load_merged(esp, bytes, count);
    return load_image(esp, bytes, count);
}

bool es_symbols(struct esp *esp, const uint8_t *bytes, size_t count) {
    if (!is_elf(bytes, count) || !is_program(bytes, count))
        return false;
    find_symbols(esp, bytes, count);
    return true;
}
