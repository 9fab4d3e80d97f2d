/* SPDX-License-Identifier: MIT
 * What the core keeps (hal_store), in two pages of flash. [task] No register here: the flash is ops.
 *
 *   page    = head | record | record | ... | blank
 *   head    = { magic, number of this page, its complement, 0 }                    one unit
 *   record  = { mark and key, byte count, CRC of both and of the value, 0 } | value | { seal }
 *
 * Everything is written once, in units of 16 bytes, and nothing is changed but by erasing a page. A new value
 * is a new record behind the others; it counts when its seal stands, which is written last. When a page is
 * full, the newest value of every key goes to the other page, and that page's head, written last, makes it
 * the one in force. So a power cut at any moment, even in the middle of a unit, leaves the old or the new
 * value. */
#ifndef WIFICNC_PIC32MZ_FLASH_STORE_H
#define WIFICNC_PIC32MZ_FLASH_STORE_H

#include "hal/hal.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    FLASH_PAGES = 2,
    FLASH_PAGE_SIZE = 16384,
    FLASH_UNIT_WORDS = 4,
    FLASH_UNIT_SIZE = 16,
    FLASH_UNITS = FLASH_PAGE_SIZE / FLASH_UNIT_SIZE,
    FLASH_KEYS = 16, /* keys are 0 .. 15 */
};

struct flash_ops {
    /** Both pages, one behind the other, as they are now: no cache in between. */
    const volatile uint32_t *words;
    /** Whole page to 1. @return false: it did not work */
    bool (*erase)(void *ctx, unsigned page);
    /** A unit that is all 1. @return false: it did not work */
    bool (*program)(void *ctx, unsigned page, unsigned unit, const uint32_t words[FLASH_UNIT_WORDS]);
};

struct flash_store {
    const struct flash_ops *ops;
    void *ctx;
};

/** ctx is a struct flash_store. */
extern const struct hal_store flash_hal_store;

#endif
