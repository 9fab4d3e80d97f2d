/* SPDX-License-Identifier: MIT
 * What time costs, when mz_set_timing() asks for it: caches in front of flash and RAM, and the buses to the
 * registers. Contents are not cached: only how long an access takes. */
#include "chip.h"

enum { LINE_BITS = 4 }; /* lines of 16 bytes */

static uint64_t units(const struct chip *chip, uint32_t cycles) {
    return (uint64_t)cycles * chip->speed;
}

/* The newest of a set first. @return true: it was there */
static bool take_line(struct cache *cache, uint32_t line, bool writes, bool *evicts) {
    struct cache_line *set = cache->line[line % cache->sets];
    struct cache_line taken = {.tag = line + 1, .dirty = writes};
    unsigned way = 0;
    while (way < CACHE_WAYS - 1 && set[way].tag != taken.tag)
        way++;
    bool hit = set[way].tag == taken.tag;
    *evicts = !hit && set[way].dirty;
    taken.dirty |= hit && set[way].dirty;
    for (; way > 0; way--)
        set[way] = set[way - 1];
    set[0] = taken;
    return hit;
}

uint64_t timing_fetch(struct chip *chip, uint32_t address) {
    struct timing *timing = &chip->timing;
    uint32_t line = (address & 0x1FFFFFFFu) >> LINE_BITS;
    bool evicts, follows = line == timing->fetched + 1;
    if (take_line(&timing->code, line, false, &evicts))
        return 0;
    timing->fetched = line;
    return units(chip, follows ? timing->cost.fetch_next : timing->cost.fetch_miss);
}

uint64_t timing_data(struct chip *chip, uint32_t address, bool writes) {
    struct timing *timing = &chip->timing;
    bool evicts;
    if (!timing->on || (address >> 29) != 4) /* KSEG1 is not cached */
        return timing->on ? units(chip, timing->cost.uncached) : 0;
    if (take_line(&timing->data, (address & 0x1FFFFFFFu) >> LINE_BITS, writes, &evicts))
        return 0;
    return units(chip, timing->cost.data_miss * (evicts ? 2 : 1));
}

void timing_register(struct chip *chip, bool writes) {
    if (chip->timing.on)
        chip->cycles += units(chip, writes ? chip->timing.cost.sfr_store : chip->timing.cost.sfr_load);
}

void timing_interrupt(struct chip *chip) {
    if (chip->timing.on)
        chip->cycles += units(chip, chip->timing.cost.interrupt);
}

void mz_set_timing(struct chip *chip, const struct mz_timing *cost) {
    chip->speed = MZ_TIMING_UNITS;
    chip->timing = (struct timing){.on = true, .cost = *cost};
    chip->timing.code.sets = CODE_SETS;
    chip->timing.data.sets = DATA_SETS;
}
