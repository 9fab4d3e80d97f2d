/* SPDX-License-Identifier: MIT
 * Flash in the address space: pages of 64 KB by a table, for as long as the cache is on. What the caches hold
 * is always right; cache.c knows what it costs. The S3 has one table for both buses; of the ESP32's two,
 * core 0's is what both cores see. */
#include "esp.h"

#include <stdlib.h>
#include <string.h>

enum { MMU_PAGE = 0x10000, PARTS = MMU_PAGE / PAGE, IRAM0_ENTRY = 64, IRAM0_FIRST = 0xD };

static bool is_s3(const struct esp *esp) {
    return esp->chip == ES_ESP32S3;
}

static bool is_valid(const struct esp *esp, uint32_t entry) {
    return (entry & (is_s3(esp) ? 1u << 14 : 1u << 8)) == 0;
}

/* Addresses of an entry. @return how many */
static unsigned addresses(const struct esp *esp, unsigned entry, uint32_t address[2]) {
    if (is_s3(esp)) {
        address[0] = 0x3C000000 + entry * MMU_PAGE;
        address[1] = 0x42000000 + entry * MMU_PAGE;
        return 2;
    }
    if (entry >= IRAM0_ENTRY && (entry < IRAM0_ENTRY + IRAM0_FIRST || entry >= 2 * IRAM0_ENTRY))
        return 0;
    address[0] =
        entry < IRAM0_ENTRY ? 0x3F400000 + entry * MMU_PAGE : 0x40000000 + (entry - IRAM0_ENTRY) * MMU_PAGE;
    return 1;
}

static bool is_code(uint32_t address) {
    return address >= 0x40000000;
}

/* ---- pages ---- */

/* Its decoded instructions wait while the cache is off: then none may be executed, and nothing has changed.
 */
static void show_page(struct esp *esp, uint32_t page, uint8_t *bytes, bool code) {
    esp->words[page] = bytes;
    esp->read[page] = code ? NULL : bytes;
    esp->plain_words[page] = esp->timed ? NULL : bytes;
    esp->plain_read[page] = esp->timed || code ? NULL : bytes;
    if (!code)
        return;
    struct op **waiting = &esp->mmu.waiting[page];
    if (bytes == NULL && *waiting == NULL) {
        *waiting = esp->code[page];
        esp->code[page] = NULL;
    } else if (bytes != NULL && *waiting != NULL) {
        free(esp->code[page]);
        esp->code[page] = *waiting;
        *waiting = NULL;
    }
}

static void show_entry(struct esp *esp, unsigned entry) {
    const struct mmu *mmu = &esp->mmu;
    const uint32_t value = mmu->entry[entry], place = (value & (is_s3(esp) ? 0x3FFF : 0xFF)) * MMU_PAGE;
    const bool is_there = mmu->visible && is_valid(esp, value) && place < esp->flash.size;
    uint32_t address[2];
    for (unsigned i = addresses(esp, entry, address); i-- > 0;)
        for (uint32_t part = 0; part < PARTS; part++)
            show_page(esp, address[i] / PAGE + part, is_there ? esp->flash.bytes + place + part * PAGE : NULL,
                      is_code(address[i]));
}

static unsigned entries(const struct esp *esp) {
    return is_s3(esp) ? 512 : 128;
}

static void show_all(struct esp *esp) {
    for (unsigned entry = 0; entry < entries(esp); entry++)
        show_entry(esp, entry);
}

static void forget_page(struct esp *esp, uint32_t page) {
    if (esp->code[page] != NULL)
        memset(esp->code[page], 0, PAGE * sizeof **esp->code);
    if (esp->mmu.waiting[page] != NULL)
        memset(esp->mmu.waiting[page], 0, PAGE * sizeof **esp->code);
}

static void forget_entry(struct esp *esp, unsigned entry) {
    uint32_t address[2];
    for (unsigned i = addresses(esp, entry, address); i-- > 0;)
        for (uint32_t part = 0; part < PARTS && is_code(address[i]); part++)
            forget_page(esp, address[i] / PAGE + part);
}

/* ---- what the rest of the chip does with it ---- */

void mmu_map(struct esp *esp, unsigned entry, uint32_t value) {
    if (esp->mmu.entry[entry] == value)
        return;
    esp->mmu.entry[entry] = value;
    if (entry >= entries(esp) || !esp->mmu.is_used)
        return;
    forget_entry(esp, entry);
    show_entry(esp, entry);
}

unsigned mmu_entry(const struct esp *esp, uint32_t address) {
    if (is_s3(esp))
        return (address & 0x1FFFFFF) / MMU_PAGE;
    return (address & 0x3FFFFF) / MMU_PAGE + (is_code(address) ? IRAM0_ENTRY : 0);
}

bool mmu_has(const struct esp *esp, uint32_t address) {
    if (is_s3(esp))
        return address - 0x3C000000 < 0x2000000 || address - 0x42000000 < 0x2000000;
    return address - 0x3F400000 < 0x400000 || address - 0x400D0000 < 0x330000;
}

void mmu_show(struct esp *esp, bool visible) {
    struct mmu *mmu = &esp->mmu;
    if (!mmu->is_used || mmu->visible == visible)
        return;
    if (visible && flash_is_busy(esp)) {
        chip_fault(
            esp, "the cache is turned on while the flash chip writes or erases: what it reads is undefined");
        return;
    }
    mmu->visible = visible;
    show_all(esp);
}

void mmu_changed(struct esp *esp, uint32_t at, uint32_t count) {
    for (unsigned entry = 0; esp->mmu.is_used && entry < entries(esp); entry++) {
        const uint32_t value = esp->mmu.entry[entry],
                       place = (value & (is_s3(esp) ? 0x3FFF : 0xFF)) * MMU_PAGE;
        if (is_valid(esp, value) && place < at + count && at < place + MMU_PAGE)
            forget_entry(esp, entry);
    }
}

/* From now on what is mapped there is flash. */
void mmu_begin(struct esp *esp) {
    struct mmu *mmu = &esp->mmu;
    if (mmu->waiting == NULL)
        mmu->waiting = calloc(PAGES, sizeof(struct op *));
    if (mmu->waiting == NULL)
        abort();
    mmu->is_used = true;
    mmu->visible = true;
    for (unsigned entry = 0; entry < MMU_ENTRIES; entry++) {
        mmu->entry[entry] = is_s3(esp) ? 1u << 14 : 1u << 8;
        forget_entry(esp, entry);
    }
    show_all(esp);
}

void mmu_destroy(struct esp *esp) {
    for (uint32_t page = 0; esp->mmu.waiting != NULL && page < PAGES; page++)
        free(esp->mmu.waiting[page]);
    free(esp->mmu.waiting);
}

/* ---- registers ---- */

static uint32_t load(struct esp *esp, uint32_t offset) {
    return esp->mmu.entry[offset / 4];
}

static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    mmu_map(esp, offset / 4, value);
}

static uint32_t load_app(struct esp *esp, uint32_t offset) {
    return esp->mmu.app_entry[offset / 4];
}

static void store_app(struct esp *esp, uint32_t offset, uint32_t value) {
    esp->mmu.app_entry[offset / 4] = value;
}

void mmu_create(struct esp *esp) {
    if (is_s3(esp)) {
        bus_add(esp, &(struct block){"flash MMU", 0x600C5000, 4 * 512, load, store, NULL});
        return;
    }
    bus_add(esp, &(struct block){"flash MMU", 0x3FF10000, 4 * MMU_ENTRIES, load, store, NULL});
    bus_add(esp,
            &(struct block){"flash MMU of core 1", 0x3FF12000, 4 * MMU_ENTRIES, load_app, store_app, NULL});
}
