/* SPDX-License-Identifier: MIT
 * The caches between the processors and flash: which lines are there, and what a miss costs. Their bytes are
 * those of the flash chip.
 *
 * ESP32: each core has one for both buses, 32 KB, two ways, lines of 32 bytes. ESP32-S3: both cores share one
 * for instructions and one for data; size, ways and lines are configured. Sources: the technical reference
 * manuals, chapters System and Memory; soc/extmem_reg.h. Which line a miss replaces is not documented: here
 * the oldest of its set, so a hit changes nothing.
 *
 * esp->lines[core][page]: a flag for each GRAIN of a page that is cached flash, NULL for other pages. */
#include "esp.h"

#include <stdlib.h>

/* `number` is the S3's cache; of the ESP32 each core has its own. */
struct range {
    uint32_t base, size, number;
};
static const struct range ranges[2][2] = {
    {{0x3F400000, 0x400000, 0}, {0x400C2000, 0x33E000, 0}},
    {{0x42000000, 0x2000000, CACHE_CODE}, {0x3C000000, 0x2000000, CACHE_DATA}},
};

static bool is_s3(const struct esp *esp) {
    return esp->chip == ES_ESP32S3;
}

/* ---- which lines are there ---- */

static void mark(struct esp *esp, unsigned core, const struct cache *cache, uint32_t line, bool is_there) {
    for (uint32_t at = line; at < line + (1u << cache->line_bits); at += GRAIN)
        esp->lines[core][at >> PAGE_BITS][(at & (PAGE - 1)) / GRAIN] = is_there;
}

static void drop(struct esp *esp, unsigned number, uint32_t *tag) {
    if (*tag != 0)
        mark(esp, is_s3(esp) ? 0 : number, &esp->cache[number], *tag, false);
    *tag = 0;
}

static void fill(struct esp *esp, unsigned number, uint32_t address) {
    struct cache *cache = &esp->cache[number];
    const uint32_t line = address >> cache->line_bits << cache->line_bits;
    const unsigned set = line >> cache->line_bits & (cache->sets - 1);
    uint32_t *tag = &cache->tag[set * cache->ways + cache->oldest[set]];
    cache->oldest[set] = (uint8_t)((cache->oldest[set] + 1) % cache->ways);
    drop(esp, number, tag);
    *tag = line;
    mark(esp, is_s3(esp) ? 0 : number, cache, line, true);
}

void cache_miss(struct esp *esp, uint32_t address) {
    const unsigned number = !is_s3(esp) ? esp->cpu->number : address < 0x40000000 ? CACHE_DATA : CACHE_CODE;
    const uint64_t from = esp->flash_free > esp->cycles ? esp->flash_free : esp->cycles;
    esp->flash_free = from + spi_line_cycles(esp, 1u << esp->cache[number].line_bits);
    esp->cpu->misses++;
    esp->cpu->missing += esp->flash_free - esp->cycles;
    esp->cycles = esp->flash_free;
    fill(esp, number, address);
}

/* ---- what the program does with them ---- */

void cache_invalidate(struct esp *esp, unsigned number, uint32_t from, uint32_t size) {
    struct cache *cache = &esp->cache[number];
    for (unsigned i = 0; i < cache->sets * cache->ways; i++)
        if (cache->tag[i] - from < size || from - cache->tag[i] < 1u << cache->line_bits)
            drop(esp, number, &cache->tag[i]);
}

void cache_flush(struct esp *esp, unsigned number) {
    struct cache *cache = &esp->cache[number];
    for (unsigned i = 0; i < cache->sets * cache->ways; i++)
        drop(esp, number, &cache->tag[i]);
}

bool cache_configure(struct esp *esp, unsigned number, uint32_t size, uint32_t ways, uint32_t line) {
    struct cache *cache = &esp->cache[number];
    const bool is_known = (size == 0x4000 || size == 0x8000 || (number == CACHE_DATA && size == 0x10000)) &&
                          (ways == 2 || ways == 4 || ways == 8) &&
                          (line == 16 || line == 32 || (number == CACHE_DATA && line == 64));
    if (!is_known) {
        chip_fault(esp, "a cache of %u bytes, %u ways, lines of %u bytes is not emulated", size, ways, line);
        return false;
    }
    cache_flush(esp, number);
    cache->line_bits = (unsigned)__builtin_ctz(line);
    cache->ways = ways;
    cache->sets = size / line / ways;
    for (unsigned set = 0; set < cache->sets; set++)
        cache->oldest[set] = 0;
    return true;
}

/* After a reset: what ESP-IDF configures by default. */
void cache_reset(struct esp *esp) {
    for (unsigned number = 0; number < CACHES; number++)
        (void)cache_configure(esp, number, number == CACHE_CODE && is_s3(esp) ? 0x4000 : 0x8000,
                              is_s3(esp) ? 8 : 2, 32);
    esp->flash_free = esp->bus_free = 0;
}

bool es_flash_configure(struct esp *esp, unsigned mhz, uint32_t code_cache) {
    const uint8_t header[4] = {[2] = 2 /* DIO */, [3] = mhz == 80 ? 15 : 0};
    const bool is_known = code_cache == 0x8000 || (is_s3(esp) && code_cache == 0x4000);
    if (!is_known || (mhz != 40 && mhz != 80))
        return false;
    spi_configure(esp, header);
    return !is_s3(esp) || cache_configure(esp, CACHE_CODE, code_cache, 8, 32);
}

/* ---- whether there are any ---- */

static void attach(struct esp *esp, unsigned core, bool on) {
    uint8_t *flags = esp->line_flags[is_s3(esp) ? 0 : core];
    for (unsigned i = 0; i < 2; i++) {
        const struct range *range = &ranges[esp->chip][i];
        for (uint32_t at = 0; at < range->size; at += PAGE, flags += PAGE / GRAIN) {
            const uint32_t page = (range->base + at) >> PAGE_BITS;
            esp->lines[core][page] = on ? flags : NULL;
            esp->plain_words[page] = on ? NULL : esp->words[page];
            esp->plain_read[page] = on ? NULL : esp->read[page];
        }
    }
}

bool cache_create(struct esp *esp) {
    const size_t grains = (ranges[esp->chip][0].size + (size_t)ranges[esp->chip][1].size) / GRAIN;
    bool good = true;
    for (unsigned core = 0; core < CORES; core++) {
        esp->lines[core] = calloc(PAGES, sizeof *esp->lines[core]);
        esp->line_flags[core] = core == 0 || !is_s3(esp) ? calloc(grains, 1) : NULL;
        good &= esp->lines[core] != NULL && (esp->line_flags[core] != NULL || (core != 0 && is_s3(esp)));
    }
    if (good)
        es_timing(esp, true);
    return good;
}

void cache_destroy(struct esp *esp) {
    for (unsigned core = 0; core < CORES; core++) {
        free(esp->lines[core]);
        free(esp->line_flags[core]);
    }
}

void es_timing(struct esp *esp, bool on) {
    esp->timed = on;
    esp->taken = on ? TAKEN : 0;
    for (unsigned core = 0; core < CORES; core++)
        attach(esp, core, on);
    cpu_forget_all(esp);
}

void es_core(const struct esp *esp, unsigned core, struct es_core *out) {
    const struct cpu *cpu = &esp->core[core % CORES];
    *out = (struct es_core){.cycles = cpu == esp->cpu ? esp->cycles : cpu->cycles,
                            .idle = cpu->idle,
                            .instructions = cpu->instructions,
                            .misses = cpu->misses,
                            .missing = cpu->missing};
}
