/* SPDX-License-Identifier: MIT
 * Switches of the whole chip: the caches' (ESP32: DPORT, S3: EXTMEM), resets of those peripherals with
 * outputs that ESP-IDF resets before a restart, and registers that only keep what is written: clocks and pads
 * of peripherals, which are always on here. */
#include "esp.h"

#include <string.h>

enum { CACHE_ENABLE = 1 << 3, FLUSH = 1 << 4, FLUSH_DONE = 1 << 5, CACHE_IDLE = 1 << 7 };
enum { ANALOG_BUS = 0x6000E000, ANALOG_STATE = 0x40, PLL_CALIBRATED = 1 << 24 }; /* of the S3 */

/* ---- registers that keep what is written ---- */

struct kept {
    const char *name;
    uint32_t base, size;
};

/* After those that do something: the first block that has an address counts. */
static const struct kept kept[2][KEPT] = {
    {
        {"DPORT", 0x3FF00000, 0x600},
        {"GPIO_SD", 0x3FF44F00, 0x40},
        {"analog bus", 0x3FF4E000, 0x100},
        {"SYSCON", 0x3FF66000, 0x100},
        {"MCPWM1", 0x3FF6C000, 0x130},
        {"I2S1", 0x3FF6D000, 0x100},
    },
    {
        {"GPIO_SD", 0x60004F00, 0x40},
        {"radio FE2", 0x60005000, 0x100},
        {"radio FE", 0x60006000, 0x100},
        {"IO_MUX", 0x60009000, 0x100},
        {"analog bus", 0x6000E000, 0x100},
        {"I2S0", 0x6000F000, 0x100},
        {"radio NRX", 0x6001CC00, 0x400},
        {"radio BB", 0x6001D000, 0x100},
        {"SYSCON", 0x60026000, 0x400},
        {"MCPWM1", 0x6002C000, 0x130},
        {"I2S1", 0x6002D000, 0x100},
        {"USB_WRAP", 0x60039000, 0x100},
        {"SARADC", 0x60040000, 0x400},
        {"SYSTEM", 0x600C0000, 0x1000},
        {"SENSITIVE", 0x600C1000, 0x1000},
        {"EXTMEM", 0x600C4000, 0x1000},
        {"ASSIST_DEBUG", 0x600CE000, 0x200},
        {"WORLD", 0x600D0000, 0x1000},
    },
};

/* ---- the ESP32's cache: of core 0, the other one's has no effect ---- */

static uint32_t cache_load(struct esp *esp, uint32_t offset) {
    (void)offset;
    return esp->cache_control[0];
}

static void set_cache(struct esp *esp, unsigned core, uint32_t value) {
    esp->cache_control[core] = value & FLUSH ? value | FLUSH_DONE : value & ~(uint32_t)FLUSH_DONE;
    if ((value & FLUSH) != 0)
        cache_flush(esp, core);
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

/* ---- the S3's caches: the boot ROM's functions turn them on and off, and they are idle ---- */

enum { EXTMEM = 0x600C4000, DCACHE_CTRL = 0x00, ICACHE_CTRL = 0x60, CACHE_STATE = 0x130 };
enum { BOTH_IDLE = 1 | 1 << 12 };

static uint32_t icache_load(struct esp *esp, uint32_t offset) {
    (void)offset;
    return (esp->cache_control[1] & 1) == 0;
}

static uint32_t dcache_load(struct esp *esp, uint32_t offset) {
    (void)offset;
    return (esp->cache_control[1] & 2) == 0;
}

static uint32_t state_load(struct esp *esp, uint32_t offset) {
    (void)esp;
    (void)offset;
    return BOTH_IDLE;
}

/* ---- resets of peripherals: DPORT_PERIP_RST_EN, SYSTEM_PERIP_RST_EN0 ---- */

enum { RESET_I2S0 = 1 << 4, RESET_MCPWM0 = 1 << 17 };
static const uint32_t resets_at[2] = {0x3FF000C4, 0x600C0020};

static uint32_t resets_load(struct esp *esp, uint32_t offset) {
    (void)offset;
    return esp->held_in_reset;
}

static void resets_store(struct esp *esp, uint32_t offset, uint32_t value) {
    (void)offset;
    const uint32_t begin = value & ~esp->held_in_reset;
    esp->held_in_reset = value;
    if ((begin & RESET_I2S0) != 0 && esp->chip == ES_ESP32) {
        i2s_sync(esp);
        i2s_reset(esp);
    }
    if ((begin & RESET_MCPWM0) != 0)
        mcpwm_reset(esp);
    chip_look(esp);
}

void dport_create(struct esp *esp) {
    esp->held_in_reset = 0;
    bus_add(esp, &(struct block){"resets", resets_at[esp->chip], 4, resets_load, resets_store, NULL});
    if (esp->chip == ES_ESP32) {
        bus_add(esp, &(struct block){"cache", 0x3FF00040, 4, cache_load, cache_store, NULL});
        bus_add(esp, &(struct block){"cache", 0x3FF00058, 4, app_cache_load, app_cache_store, NULL});
        bus_add(esp, &(struct block){"cache state", 0x3FF003F0, 4, idle_load, idle_store, NULL});
        bus_add(esp, &(struct block){"cache state", 0x3FF00418, 4, idle_load, idle_store, NULL});
    }
    if (esp->chip == ES_ESP32S3) {
        bus_add(esp, &(struct block){"cache", EXTMEM + ICACHE_CTRL, 4, icache_load, idle_store, NULL});
        bus_add(esp, &(struct block){"cache", EXTMEM + DCACHE_CTRL, 4, dcache_load, idle_store, NULL});
        bus_add(esp, &(struct block){"cache state", EXTMEM + CACHE_STATE, 4, state_load, idle_store, NULL});
    }
    memset(esp->kept, 0, sizeof esp->kept);
    for (unsigned i = 0; i < KEPT && esp->chip == ES_ESP32S3; i++)
        if (kept[ES_ESP32S3][i].base == ANALOG_BUS)
            esp->kept[i][ANALOG_STATE / 4] = PLL_CALIBRATED;
    for (unsigned i = 0; i < KEPT; i++) {
        const struct kept *k = &kept[esp->chip][i];
        if (k->size != 0)
            bus_add(esp, &(struct block){
                             .name = k->name, .base = k->base, .size = k->size, .words = esp->kept[i]});
    }
}
