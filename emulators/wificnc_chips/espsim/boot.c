/* SPDX-License-Identifier: MIT
 * From a flash chip to its application: what the boot ROM and the second-stage bootloader do, without running
 * them. Partition table, the choice by otadata with a new application's trial, the image's checks, pages of
 * flash, jump. */
#include "digest.h"
#include "esp.h"

#include <string.h>

enum { TABLE = 0x8000, TABLE_SIZE = 0xC00, ENTRY = 32, ENTRY_MAGIC = 0x50AA, DIGEST_MAGIC = 0xEBEB };
enum {
    TYPE_APP = 0,
    TYPE_DATA = 1,
    FACTORY = 0,
    OTA_FIRST = 0x10,
    OTA_SLOTS = 16,
    DATA_OTA = 0,
    ENCRYPTED = 1
};
enum { STREAMS = 0x3FFAE300, STREAMS_SIZE = 8 * 104 };
enum { SECTOR = 4096, MMU_PAGE = 0x10000, PLACE_MASK = MMU_PAGE - 1 };
enum ota_state { OTA_NEW = 0, OTA_PENDING = 1, OTA_INVALID = 3, OTA_ABORTED = 4 };

static const uint32_t bootloader_at[2] = {0x1000, 0};

static uint32_t word(const uint8_t *at) {
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static uint32_t half(const uint8_t *at) {
    return at[0] | (uint32_t)at[1] << 8;
}

/* Of an image's header; a size that it does not name is 4 MB. */
size_t boot_flash_size(const uint8_t *header) {
    const unsigned code = header[3] >> 4;
    return (size_t)1 << (20 + (code <= 4 ? code : 2));
}

/* ---- partition table ---- */

/* What counts here: where applications are, and which of them is to start. */
struct partitions {
    uint32_t factory, ota[OTA_SLOTS], otadata;
    uint32_t factory_size, ota_size[OTA_SLOTS];
    unsigned slots;
};

static bool add_partition(struct esp *esp, struct partitions *found, const uint8_t *entry) {
    const uint32_t type = entry[2], subtype = entry[3], at = word(entry + 4), size = word(entry + 8);
    if (at > esp->flash.size || size > esp->flash.size - at) {
        chip_fault(esp,
                   "the partition %.16s ends at %x, but the flash has %x bytes (%u MB); build for this size",
                   (const char *)entry + 12, at + size, esp->flash.size, esp->flash.size >> 20);
        return false;
    }
    if (type == TYPE_APP && (word(entry + 28) & ENCRYPTED) != 0) {
        chip_fault(esp, "the partition %.16s is encrypted, which is not emulated", (const char *)entry + 12);
        return false;
    }
    if (type == TYPE_APP && subtype == FACTORY) {
        found->factory = at;
        found->factory_size = size;
    } else if (type == TYPE_APP && subtype - OTA_FIRST < OTA_SLOTS) {
        found->ota[subtype - OTA_FIRST] = at;
        found->ota_size[subtype - OTA_FIRST] = size;
        found->slots++;
    } else if (type == TYPE_DATA && subtype == DATA_OTA)
        found->otadata = at;
    return true;
}

static bool has_digest(const uint8_t *table, uint32_t size, const uint8_t digest[16]) {
    struct md5 md5;
    uint8_t found[16];
    md5_begin(&md5);
    md5_add(&md5, table, size);
    md5_end(&md5, found);
    return memcmp(found, digest, sizeof found) == 0;
}

static bool read_table(struct esp *esp, struct partitions *found) {
    const uint8_t *table = esp->flash.bytes + TABLE;
    *found = (struct partitions){0};
    if (half(table) != ENTRY_MAGIC) {
        chip_fault(esp,
                   "this flash has no partition table at %x; load a merged image (wificnc build makes one)",
                   TABLE);
        return false;
    }
    for (uint32_t at = 0; at < TABLE_SIZE; at += ENTRY) {
        const uint32_t magic = half(table + at);
        if (magic == 0xFFFF)
            break;
        if (magic == DIGEST_MAGIC ? !has_digest(table, at, table + at + 16) : magic != ENTRY_MAGIC) {
            chip_fault(esp, "the partition table is damaged: %s",
                       magic == DIGEST_MAGIC ? "its MD5 is another one"
                                             : "an entry does not begin with 50aa");
            return false;
        }
        if (magic == ENTRY_MAGIC && !add_partition(esp, found, table + at))
            return false;
    }
    return true;
}

/* ---- otadata: two sectors with a number each, the greater one counts ---- */

static uint8_t *entry_at(const struct esp *esp, uint32_t otadata, unsigned number) {
    return esp->flash.bytes + otadata + number * SECTOR;
}

static bool is_valid(const uint8_t *entry) {
    const uint32_t sequence = word(entry), state = word(entry + 24);
    return sequence != UINT32_MAX && state != OTA_INVALID && state != OTA_ABORTED &&
           word(entry + 28) == crc32_rom(UINT32_MAX, entry, 4);
}

/* The newer entry. @return NULL: none is valid */
static uint8_t *newest(const struct esp *esp, uint32_t otadata) {
    uint8_t *a = entry_at(esp, otadata, 0), *b = entry_at(esp, otadata, 1);
    if (!is_valid(a) || !is_valid(b))
        return is_valid(a) ? a : is_valid(b) ? b : NULL;
    return word(b) > word(a) ? b : a;
}

static void set_state(uint8_t *entry, enum ota_state state) {
    memset(entry + 24, 0, 4);
    entry[24] = (uint8_t)state;
}

/* A new application is on trial; one that has not proved itself until now is not started again. */
static uint8_t *after_trials(const struct esp *esp, uint32_t otadata) {
    uint8_t *entry = newest(esp, otadata);
    if (entry != NULL && word(entry + 24) == OTA_PENDING) {
        set_state(entry, OTA_ABORTED);
        entry = newest(esp, otadata);
    }
    if (entry != NULL && word(entry + 24) == OTA_NEW)
        set_state(entry, OTA_PENDING);
    return entry;
}

/* Places of applications in the order in which they are tried. @return how many */
static unsigned candidates(const struct esp *esp, const struct partitions *parts,
                           uint32_t place[OTA_SLOTS + 1], uint32_t size[OTA_SLOTS + 1]) {
    const uint8_t *entry =
        parts->otadata != 0 && parts->slots != 0 ? after_trials(esp, parts->otadata) : NULL;
    unsigned count = 0;
    const bool has_factory = parts->factory_size != 0;
    if (entry == NULL && has_factory) {
        size[count] = parts->factory_size;
        place[count++] = parts->factory;
    }
    const unsigned first = entry == NULL || parts->slots == 0 ? 0 : (word(entry) - 1) % parts->slots;
    for (unsigned i = 0; i < parts->slots; i++) {
        size[count] = parts->ota_size[(first + i) % parts->slots];
        place[count++] = parts->ota[(first + i) % parts->slots];
    }
    if (entry != NULL && has_factory) {
        size[count] = parts->factory_size;
        place[count++] = parts->factory;
    }
    return count;
}

/* ---- start ---- */

/* The entry of the MMU's table that maps an address, and what it has to be. */
struct page {
    unsigned entry;
    uint32_t value;
};

static struct page page_of(const struct esp *esp, const struct piece *piece, uint32_t place,
                           uint32_t offset) {
    const uint32_t first = piece->address & ~(uint32_t)PLACE_MASK;
    const uint32_t flash = (place + (uint32_t)piece->at) & ~(uint32_t)PLACE_MASK;
    return (struct page){mmu_entry(esp, first + offset), (flash + offset) / MMU_PAGE};
}

static uint32_t pages_end(const struct piece *piece) {
    return (piece->address & PLACE_MASK) + (uint32_t)piece->count;
}

/* The S3 has one table for both buses: code and constants need pages of their own. */
static bool collides(const struct esp *esp, const struct piece *a, const struct piece *b, uint32_t place) {
    for (uint32_t i = 0; i < pages_end(a); i += MMU_PAGE)
        for (uint32_t j = 0; j < pages_end(b); j += MMU_PAGE) {
            const struct page x = page_of(esp, a, place, i), y = page_of(esp, b, place, j);
            if (x.entry == y.entry && x.value != y.value)
                return true;
        }
    return false;
}

static bool has_own_pages(struct esp *esp, const struct image *image, uint32_t place) {
    for (unsigned i = 0; i < image->count; i++)
        for (unsigned other = 0; other < i; other++) {
            const struct piece *a = &image->piece[other], *b = &image->piece[i];
            if (!mmu_has(esp, a->address) || !mmu_has(esp, b->address) || !collides(esp, a, b, place))
                continue;
            chip_fault(esp, "the segments for %08x and %08x need the same page of the flash MMU", a->address,
                       b->address);
            return false;
        }
    return true;
}

/* Its place in flash must have the address's place in a page. */
bool boot_can_map(struct esp *esp, const struct image *image, uint32_t place) {
    for (unsigned i = 0; i < image->count; i++) {
        const struct piece *piece = &image->piece[i];
        if (!mmu_has(esp, piece->address) || ((piece->address ^ (place + piece->at)) & PLACE_MASK) == 0)
            continue;
        chip_fault(esp, "the segment for %08x is at %zx in flash, which no page of 64 KB maps there",
                   piece->address, place + piece->at);
        return false;
    }
    return has_own_pages(esp, image, place);
}

static void map(struct esp *esp, const struct piece *piece, uint32_t place) {
    for (uint32_t offset = 0; offset < pages_end(piece); offset += MMU_PAGE) {
        const struct page page = page_of(esp, piece, place, offset);
        mmu_map(esp, page.entry, page.value);
    }
}

/* esp_rom_spiflash_chip_t of the boot ROM: id, size, block, sector, page, mask of the status. */
static void put_flash_chip(struct esp *esp) {
    const uint32_t size = esp->flash.size;
    const uint32_t chip[6] = {0xEF4000u + (uint32_t)__builtin_ctz(size), size, MMU_PAGE, SECTOR, 256, 0xFFFF};
    static const uint32_t pointer_of_s3 = 0x3FCEFFE4, place[2] = {0x3FFAE270, 0x3FCEF000};
    (void)es_write(esp, place[esp->chip], (const uint8_t *)chip, sizeof chip);
    static const uint8_t none[STREAMS_SIZE];
    if (esp->chip == ES_ESP32) /* romcode/code.c: streams that are free */
        (void)es_write(esp, STREAMS, none, sizeof none);
    if (esp->chip == ES_ESP32S3)
        (void)es_write(esp, pointer_of_s3, (const uint8_t *)&place[ES_ESP32S3], sizeof *place);
}

/* The ends of the boot ROM's stack. */
static const uint32_t stack[2] = {0x3FFE3F20, 0x3FCEB710};

bool boot_start(struct esp *esp, const struct image *image, uint32_t place) {
    const uint8_t *bytes = esp->flash.bytes + place;
    struct cpu *cpu = &esp->core[0];
    if (!boot_can_map(esp, image, place))
        return false;
    cpu_reset(esp, cpu);
    mmu_begin(esp);
    esp->cache_control[0] |= 1 << 3;
    spi_configure(esp, bytes);
    for (unsigned i = 0; i < image->count; i++) {
        const struct piece *piece = &image->piece[i];
        if (mmu_has(esp, piece->address))
            map(esp, piece, place);
        else if (piece->count != 0)
            (void)es_write(esp, piece->address, bytes + piece->at, piece->count);
    }
    put_flash_chip(esp);
    cpu_start(esp, cpu, image->entry, stack[esp->chip]);
    chip_look(esp);
    return true;
}

/* The first whose image is whole. What is wrong with the one that was to start counts, if none is. */
static bool boot(struct esp *esp) {
    struct partitions parts;
    uint32_t place[OTA_SLOTS + 1], size[OTA_SLOTS + 1];
    struct image image;
    if (!read_table(esp, &parts))
        return false;
    const unsigned count = candidates(esp, &parts, place, size);
    if (count == 0)
        chip_fault(esp, "the partition table has no application");
    for (unsigned i = 0; i < count; i++) {
        char first[sizeof esp->fault];
        memcpy(first, esp->fault, sizeof first);
        esp->stop = ES_TIME;
        if (image_read(esp, esp->flash.bytes + place[i], size[i], &image) &&
            boot_start(esp, &image, place[i])) {
            esp->fault[0] = '\0';
            return true;
        }
        if (i != 0)
            memcpy(esp->fault, first, sizeof first);
    }
    return false;
}

/* As the boot ROM does: what is in RAM, nothing mapped. */
static bool start_bootloader(struct esp *esp) {
    struct image image;
    const uint32_t place = bootloader_at[esp->chip];
    return image_read(esp, esp->flash.bytes + place, TABLE - place, &image) && boot_start(esp, &image, place);
}

bool boot_again(struct esp *esp) {
    esp->flash.busy_until = 0;
    esp->flash.write_enabled = false;
    return esp->runs_bootloader ? start_bootloader(esp) : boot(esp);
}

void es_run_bootloader(struct esp *esp, bool on) {
    esp->runs_bootloader = on;
}

/* A power-on: no write or erase continues. */
bool es_boot(struct esp *esp) {
    esp->stop = ES_TIME;
    esp->fault[0] = '\0';
    esp->flash.cut_at = 0;
    if (esp->flash.size == 0)
        chip_fault(esp, "there is no flash chip to start from; load an image");
    if (esp->stop == ES_FAULT)
        return false;
    chip_power_on(esp);
    return boot_again(esp);
}

/* ---- merged images ---- */

bool boot_is_merged(const uint8_t *bytes, size_t size) {
    return size > TABLE + ENTRY && half(bytes + TABLE) == ENTRY_MAGIC;
}

bool boot_load_merged(struct esp *esp, const uint8_t *bytes, size_t size) {
    const uint8_t *header = bytes + bootloader_at[esp->chip];
    struct image bootloader;
    if (!image_read(esp, header, TABLE - bootloader_at[esp->chip], &bootloader))
        return false;
    const size_t room = boot_flash_size(header);
    if (size > room) {
        chip_fault(esp, "the merged image has %zu bytes, but its flash %zu MB", size, room >> 20);
        return false;
    }
    return flash_create(esp, room) && es_flash_write(esp, 0, bytes, size) && es_boot(esp);
}
