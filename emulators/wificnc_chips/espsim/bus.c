/* SPDX-License-Identifier: MIT
 * Addresses: memories, and registers of peripherals. Tables of the technical reference manuals, chapter
 * System and Memory. Flash is a memory of its own for an ELF file; with an image in a flash chip it is what
 * the MMU maps.
 */
#include "rom.h"

#include <stdlib.h>
#include <string.h>

struct region {
    const char *name;
    uint32_t base, size;
    bool words_only, constant;
    uint32_t twin; /* the same bytes at another address; 0: none */
};

static const struct region esp32[] = {
    {"DRAM", 0x3FFAE000, 0x52000, false, false, 0},
    {"IRAM", 0x40070000, 0x30000, true, false, 0},
    {"flash data", 0x3F400000, 0x400000, false, true, 0},
    {"flash code", 0x400C2000, 0x33E000, true, true, 0},
    {"RTC fast memory", 0x3FF80000, 0x2000, false, false, 0},
    {"data of the boot ROM", 0x3FF96000, 0x1000, false, true, 0},
    {"RTC slow memory", 0x50000000, 0x2000, false, false, 0},
    {"vectors of the boot ROM", 0x40000000, 0x1000, true, true, 0},
    {"code of the boot ROM", ROM_CODE, 0x1000, true, true, 0},
};

static const struct region esp32s3[] = {
    {"DRAM", 0x3FC88000, 0x78000, false, false, 0},
    {"IRAM", 0x40370000, 0x8000, true, false, 0},
    {"IRAM", 0x40378000, 0x68000, true, false, 0x3FC88000},
    {"flash data", 0x3C000000, 0x2000000, false, true, 0},
    {"flash code", 0x42000000, 0x2000000, true, true, 0},
    {"data of the boot ROM", 0x3FF1F000, 0x1000, false, true, 0},
    {"RTC fast memory", 0x600FE000, 0x2000, false, false, 0},
    {"RTC slow memory", 0x50000000, 0x2000, false, false, 0},
    {"vectors of the boot ROM", 0x40000000, 0x1000, true, true, 0},
    {"code of the boot ROM", ROM_CODE, 0x1000, true, true, 0},
};

static struct memory *memory_at(const struct esp *esp, uint32_t address) {
    for (unsigned i = 0; i < esp->memory_count; i++)
        if (address - esp->memory[i].base < esp->memory[i].size)
            return (struct memory *)&esp->memory[i];
    return NULL;
}

/* Pages may lie anywhere in the flash chip, and be missing. */
uint8_t *bus_bytes(const struct esp *esp, uint32_t address, size_t count) {
    const struct memory *memory = memory_at(esp, address);
    if (memory == NULL || count > memory->size - (address - memory->base))
        return NULL;
    uint8_t *first = esp->words[address >> PAGE_BITS];
    const uint32_t end = (uint32_t)((address & (PAGE - 1)) + count);
    for (uint32_t at = PAGE; first != NULL && at < end; at += PAGE)
        if (esp->words[(address + at) >> PAGE_BITS] != first + at)
            return NULL;
    return first == NULL ? NULL : first + (address & (PAGE - 1));
}

static bool add(struct esp *esp, const struct region *region) {
    struct memory *memory = &esp->memory[esp->memory_count];
    uint8_t *bytes = region->twin != 0 ? bus_bytes(esp, region->twin, region->size) : calloc(1, region->size);
    if (bytes == NULL)
        return false;
    *memory = (struct memory){region->name, region->base,       region->size,
                              bytes,        region->words_only, region->constant};
    esp->memory_count++;
    for (uint32_t at = 0; at < region->size; at += PAGE) {
        const uint32_t page = (region->base + at) >> PAGE_BITS;
        esp->plain_words[page] = esp->words[page] = bytes + at;
        esp->plain_read[page] = esp->read[page] = region->words_only ? NULL : bytes + at;
        esp->write[page] = region->words_only || region->constant ? NULL : bytes + at;
    }
    return true;
}

bool bus_create(struct esp *esp) {
    const bool is_s3 = esp->chip == ES_ESP32S3;
    const struct region *regions = is_s3 ? esp32s3 : esp32;
    const size_t count = is_s3 ? sizeof esp32s3 / sizeof *regions : sizeof esp32 / sizeof *regions;
    esp->read = calloc(PAGES, sizeof *esp->read);
    esp->write = calloc(PAGES, sizeof *esp->write);
    esp->words = calloc(PAGES, sizeof *esp->words);
    esp->plain_read = calloc(PAGES, sizeof *esp->plain_read);
    esp->plain_words = calloc(PAGES, sizeof *esp->plain_words);
    esp->code = calloc(PAGES, sizeof *esp->code);
    bool good = esp->read != NULL && esp->write != NULL && esp->words != NULL && esp->code != NULL &&
                esp->plain_read != NULL && esp->plain_words != NULL;
    for (size_t i = 0; i < count && good; i++)
        good = add(esp, &regions[i]);
    return good && cache_create(esp);
}

void bus_destroy(struct esp *esp) {
    for (unsigned i = 0; i < esp->memory_count; i++) {
        bool is_twin = false;
        for (unsigned other = 0; other < i; other++)
            is_twin |= esp->memory[other].bytes == esp->memory[i].bytes;
        if (!is_twin)
            free(esp->memory[i].bytes);
    }
    for (uint32_t page = 0; esp->code != NULL && page < PAGES; page++)
        free(esp->code[page]);
    free(esp->read);
    free(esp->write);
    free(esp->words);
    free(esp->plain_read);
    free(esp->plain_words);
    cache_destroy(esp);
    free(esp->code);
}

void bus_add(struct esp *esp, const struct block *block) {
    esp->block[esp->block_count++] = *block;
}

/* The ESP32 has its peripherals twice, on two buses. */
static uint32_t on_dport(const struct esp *esp, uint32_t address) {
    return esp->chip == ES_ESP32 && address - 0x60000000 < 0x40000 ? address - 0x60000000 + 0x3FF40000
                                                                   : address;
}

static const struct block *block_at(const struct esp *esp, uint32_t address) {
    const uint32_t at = on_dport(esp, address);
    for (unsigned i = 0; i < esp->block_count; i++)
        if (at - esp->block[i].base < esp->block[i].size)
            return &esp->block[i];
    return NULL;
}

const char *bus_missing(const struct esp *esp, uint32_t address, const char *otherwise) {
    const struct memory *memory = memory_at(esp, address);
    if (memory == NULL || !memory->constant || !esp->mmu.is_used)
        return otherwise;
    return esp->mmu.visible ? "where no flash is mapped" : "which is flash, while its cache is off";
}

static void nothing_there(struct esp *esp, const char *what, uint32_t address) {
    char text[96];
    chip_fault(esp, "%s %08x, %s, by the instruction at %s", what, address,
               bus_missing(esp, address, "where nothing is emulated"), chip_place(esp, esp->cpu->pc, text));
}

/* Registers are words, and aligned. */
static bool is_word(struct esp *esp, uint32_t address, unsigned size, const char *what) {
    char text[96];
    if (size == 4 && (address & 3) == 0)
        return true;
    chip_fault(esp, "%s of %u bytes at the register %08x by the instruction at %s", what, size, address,
               chip_place(esp, esp->cpu->pc, text));
    return false;
}

/* Accesses of both cores come in the order of time. @return false: it is for a later turn, or no access */
static bool may_access(struct esp *esp, uint32_t address, unsigned size, const char *what) {
    if (cores_retry(esp))
        return false;
    return is_word(esp, address, size, what);
}

/* An access to a register: one after the other, of both cores. After a store the core continues. */
static void begin_access(struct esp *esp) {
    if (esp->timed && esp->cycles < esp->bus_free)
        esp->cycles = esp->bus_free;
    if (esp->timed)
        esp->cpu->bus_free = esp->bus_free = esp->cycles + BUS;
}

static uint32_t block_load(struct esp *esp, const struct block *block, uint32_t address) {
    const uint32_t offset = address - block->base;
    begin_access(esp);
    const uint64_t end = esp->bus_free;
    const uint32_t value = block->load == NULL ? block->words[offset / 4] : block->load(esp, offset);
    if (esp->timed && esp->cycles < end)
        esp->cycles = end;
    return value;
}

static void block_store(struct esp *esp, const struct block *block, uint32_t address, uint32_t value) {
    const uint32_t offset = address - block->base;
    begin_access(esp);
    if (block->store == NULL)
        block->words[offset / 4] = value;
    else
        block->store(esp, offset, value);
}

uint32_t bus_load(struct esp *esp, uint32_t address, unsigned size) {
    const struct memory *memory = memory_at(esp, address);
    const struct block *block = memory == NULL ? block_at(esp, address) : NULL;
    uint32_t value = 0;
    if (block != NULL)
        return may_access(esp, address, size, "load") ? block_load(esp, block, on_dport(esp, address)) : 0;
    if (memory == NULL || bus_bytes(esp, address, size) == NULL)
        nothing_there(esp, "load from", address);
    else if (memory->words_only && (size != 4 || (address & 3) != 0))
        cpu_exception_at(esp, CAUSE_LOAD_STORE, address);
    else {
        const uint8_t *lines = esp->lines[esp->cpu->number][address >> PAGE_BITS];
        if (lines != NULL && !lines[(address & (PAGE - 1)) / GRAIN]) {
            if (cores_retry(esp))
                return 0;
            cache_miss(esp, address);
        }
        memcpy(&value, bus_bytes(esp, address, size), size);
    }
    return value;
}

/* Code in IRAM is the same bytes at another address on the S3. */
static void changed(struct esp *esp, const uint8_t *bytes, size_t count) {
    for (unsigned i = 0; i < esp->memory_count; i++) {
        const struct memory *memory = &esp->memory[i];
        if (bytes >= memory->bytes && bytes < memory->bytes + memory->size)
            cpu_forget(esp, memory->base + (uint32_t)(bytes - memory->bytes), count);
    }
}

void bus_store(struct esp *esp, uint32_t address, uint32_t value, unsigned size) {
    const struct memory *memory = memory_at(esp, address);
    const struct block *block = memory == NULL ? block_at(esp, address) : NULL;
    uint8_t *bytes = bus_bytes(esp, address, size);
    char text[96];
    if (block != NULL) {
        if (may_access(esp, address, size, "store"))
            block_store(esp, block, on_dport(esp, address), value);
    } else if (bytes == NULL)
        nothing_there(esp, "store to", address);
    else if (memory->constant)
        chip_fault(esp, "store to %08x, which is %s, by the instruction at %s", address, memory->name,
                   chip_place(esp, esp->cpu->pc, text));
    else if (memory->words_only && (size != 4 || (address & 3) != 0))
        cpu_exception_at(esp, CAUSE_LOAD_STORE, address);
    else {
        memcpy(bytes, &value, size);
        changed(esp, bytes, size);
    }
}

bool bus_fetch(struct esp *esp, uint32_t address, uint32_t *word) {
    const struct memory *memory = memory_at(esp, address);
    if (memory == NULL || !memory->words_only || esp->words[address >> PAGE_BITS] == NULL)
        return false;
    *word = 0;
    for (uint32_t i = 0; i < 4; i++) {
        const uint8_t *page = esp->words[(address + i) >> PAGE_BITS];
        if (page != NULL)
            *word |= (uint32_t)page[(address + i) & (PAGE - 1)] << 8 * i;
    }
    return true;
}

/* ---- memory as a debugger sees it: the S3's instruction RAM is two memories that follow each other ---- */

/* Bytes from this address to the end of its page, as many as are wanted. */
static uint32_t in_page(uint32_t address, size_t count) {
    const uint32_t room = PAGE - (address & (PAGE - 1));
    return count < room ? (uint32_t)count : room;
}

bool bus_has(const struct esp *esp, uint32_t address, size_t count) {
    for (uint32_t part; count != 0; address += part, count -= part) {
        part = in_page(address, count);
        if (bus_bytes(esp, address, part) == NULL)
            return false;
    }
    return true;
}

bool es_write(struct esp *esp, uint32_t address, const uint8_t *bytes, size_t count) {
    if (!bus_has(esp, address, count))
        return false;
    for (uint32_t part; count != 0; address += part, bytes += part, count -= part) {
        part = in_page(address, count);
        uint8_t *at = bus_bytes(esp, address, part);
        memcpy(at, bytes, part);
        changed(esp, at, part);
    }
    return true;
}

bool es_read(const struct esp *esp, uint32_t address, uint8_t *bytes, size_t count) {
    if (!bus_has(esp, address, count))
        return false;
    for (uint32_t part; count != 0; address += part, bytes += part, count -= part) {
        part = in_page(address, count);
        memcpy(bytes, bus_bytes(esp, address, part), part);
    }
    return true;
}
