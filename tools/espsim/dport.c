/* SPDX-License-Identifier: MIT
 * Switches of the whole chip: the caches' (ESP32: DPORT, S3: EXTMEM), and registers that only keep what is
 * written: clocks, resets and pads of peripherals, which are always on here. */
#include "esp.h"

enum { CACHE_ENABLE = 1 << 3, FLUSH = 1 << 4, FLUSH_DONE = 1 << 5, CACHE_IDLE = 1 << 7 };

/* ---- registers that keep what is written ---- */

struct kept {
    const char *name;
    uint32_t base, size;
};

static const struct kept kept[2][KEPT] = {
    {
        {"DPORT", 0x3FF00000,
         0x600}, /* after those that do something: the first block that has an address counts */
        {"IO_MUX", 0x3FF49000, 0x94},
    },
    {
        {"SYSTEM", 0x600C0000, 0x1000},
        {"IO_MUX", 0x60009000, 0x100},
    },
};

static uint32_t keep_load(struct esp *esp, unsigned number, uint32_t offset) {
    return esp->kept[number][offset / 4];
}

static void keep_store(struct esp *esp, unsigned number, uint32_t offset, uint32_t value) {
    esp->kept[number][offset / 4] = value;
}

#define KEEP(n)                                                                                              \
    static uint32_t keep_load##n(struct esp *esp, uint32_t offset) {                                         \
        return keep_load(esp, n, offset);                                                                    \
    }                                                                                                        \
    static void keep_store##n(struct esp *esp, uint32_t offset, uint32_t value) {                            \
        keep_store(esp, n, offset, value);                                                                   \
    }
KEEP(0)
KEEP(1)
KEEP(2)
KEEP(3)
KEEP(4)
KEEP(5)
KEEP(6)
KEEP(7)

static uint32_t (*const keep_loads[KEPT])(struct esp *, uint32_t) = {
    keep_load0, keep_load1, keep_load2, keep_load3, keep_load4, keep_load5, keep_load6, keep_load7};
static void (*const keep_stores[KEPT])(struct esp *, uint32_t, uint32_t) = {
    keep_store0, keep_store1, keep_store2, keep_store3, keep_store4, keep_store5, keep_store6, keep_store7};

/* ---- the ESP32's cache: of core 0, the other one's has no effect ---- */

static uint32_t cache_load(struct esp *esp, uint32_t offset) {
    (void)offset;
    return esp->cache_control[0];
}

static void set_cache(struct esp *esp, unsigned core, uint32_t value) {
    esp->cache_control[core] = value & FLUSH ? value | FLUSH_DONE : value & ~(uint32_t)FLUSH_DONE;
    if (core == 0)
        mmu_show(esp, (value & CACHE_ENABLE) != 0);
}

static void cache_store(struct esp *esp, uint32_t offset, uint32_t value) {
    (void)offset;
    set_cache(esp, 0, value);
}

static uint32_t app_cache_load(struct esp *esp, uint32_t offset) {
    (void)offset;
    return esp->cache_control[1];
}

static void app_cache_store(struct esp *esp, uint32_t offset, uint32_t value) {
    (void)offset;
    set_cache(esp, 1, value);
}

void dport_cache(struct esp *esp, unsigned core, bool on) {
    set_cache(esp, core,
              on ? esp->cache_control[core] | CACHE_ENABLE
                 : esp->cache_control[core] & ~(uint32_t)CACHE_ENABLE);
}

static uint32_t idle_load(struct esp *esp, uint32_t offset) {
    (void)esp;
    (void)offset;
    return CACHE_IDLE;
}

static void idle_store(struct esp *esp, uint32_t offset, uint32_t value) {
    (void)esp;
    (void)offset;
    (void)value;
}

void dport_create(struct esp *esp) {
    if (esp->chip == ES_ESP32) {
        bus_add(esp, &(struct block){"cache", 0x3FF00040, 4, cache_load, cache_store});
        bus_add(esp, &(struct block){"cache", 0x3FF00058, 4, app_cache_load, app_cache_store});
        bus_add(esp, &(struct block){"cache state", 0x3FF003F0, 4, idle_load, idle_store});
        bus_add(esp, &(struct block){"cache state", 0x3FF00418, 4, idle_load, idle_store});
    }
    for (unsigned i = 0; i < KEPT; i++) {
        const struct kept *k = &kept[esp->chip][i];
        if (k->size != 0)
            bus_add(esp, &(struct block){k->name, k->base, k->size, keep_loads[i], keep_stores[i]});
    }
}
