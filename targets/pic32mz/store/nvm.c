/* SPDX-License-Identifier: MIT */
#include "store/nvm.h"

#include "chip/interrupts.h"
#include "chip/sfr.h"
#include "chip/system.h"

/* The linker script's. Read past the cache, which does not know what the controller writes. */
#define STORE_PHYSICAL 0x1D180000u
#define STORE_UNCACHED ((const volatile uint32_t *)(0xA0000000u | STORE_PHYSICAL))

/* Section 5: NVMCON first, then the key's three writes with nothing between them. */
static bool carry_out(uint32_t operation) {
    NVMCON = NVMCON_WREN | operation;
    uint32_t held = interrupts_hold();
    NVMKEY = 0;
    NVMKEY = 0xAA996655u;
    NVMKEY = 0x556699AAu;
    SFR_SET(NVMCON_ADDRESS) = NVMCON_WR;
    interrupts_restore(held);
    while ((NVMCON & NVMCON_WR) != 0)
        system_watchdog_clear();
    bool good = (NVMCON & (NVMCON_WRERR | NVMCON_LVDERR)) == 0;
    SFR_CLR(NVMCON_ADDRESS) = NVMCON_WREN;
    return good;
}

static bool erase(void *ctx, unsigned page) {
    (void)ctx;
    NVMADDR = STORE_PHYSICAL + page * FLASH_PAGE_SIZE;
    return carry_out(NVMOP_ERASE);
}

static bool program(void *ctx, unsigned page, unsigned unit, const uint32_t words[FLASH_UNIT_WORDS]) {
    (void)ctx;
    NVMADDR = STORE_PHYSICAL + page * FLASH_PAGE_SIZE + unit * FLASH_UNIT_SIZE;
    for (unsigned word = 0; word < FLASH_UNIT_WORDS; word++)
        NVMDATA(word) = words[word];
    return carry_out(NVMOP_QUAD_WORD);
}

const struct flash_ops nvm_flash_ops = {.words = STORE_UNCACHED, .erase = erase, .program = program};
