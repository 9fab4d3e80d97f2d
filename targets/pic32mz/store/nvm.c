/* SPDX-License-Identifier: MIT */
#include "store/nvm.h"

#include "chip/interrupts.h"
#include "chip/sfr.h"

/* The linker script's. Read past the cache, which does not know what the controller writes. */
#define STORE_PHYSICAL 0x1D180000u
#define STORE_UNCACHED ((const volatile uint32_t *)(0xA0000000u | STORE_PHYSICAL))

/* Section 5: NVMCON first, then the key's three writes with nothing between them. */
static void begin(uint32_t operation) {
    NVMCON = NVMCON_WREN | operation;
    uint32_t held = interrupts_hold();
    NVMKEY = 0;
    NVMKEY = 0xAA996655u;
    NVMKEY = 0x556699AAu;
    SFR_SET(NVMCON_ADDRESS) = NVMCON_WR;
    interrupts_restore(held);
}

static void erase(void *ctx, unsigned page) {
    (void)ctx;
    NVMADDR = STORE_PHYSICAL + page * FLASH_PAGE_SIZE;
    begin(NVMOP_ERASE);
}

static void program(void *ctx, unsigned page, unsigned unit, const uint32_t words[FLASH_UNIT_WORDS]) {
    (void)ctx;
    NVMADDR = STORE_PHYSICAL + page * FLASH_PAGE_SIZE + unit * FLASH_UNIT_SIZE;
    for (unsigned word = 0; word < FLASH_UNIT_WORDS; word++)
        NVMDATA(word) = words[word];
    begin(NVMOP_QUAD_WORD);
}

static enum hal_store_state state(void *ctx) {
    (void)ctx;
    uint32_t now = NVMCON;
    if ((now & NVMCON_WR) != 0)
        return HAL_STORE_BUSY;
    SFR_CLR(NVMCON_ADDRESS) = NVMCON_WREN;
    return (now & (NVMCON_WRERR | NVMCON_LVDERR)) == 0 ? HAL_STORE_DONE : HAL_STORE_FAILED;
}

void nvm_wait(void) {
    while (state(NULL) == HAL_STORE_BUSY) {
    }
}

const struct flash_ops nvm_flash_ops = {
    .words = STORE_UNCACHED, .erase = erase, .program = program, .state = state};
