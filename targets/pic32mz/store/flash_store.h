/* SPDX-License-Identifier: MIT
 * What the core keeps (hal_store), in pages of flash. [task] No register here: the flash is ops.
 *
 *   page    = head | the same head again | record | record | ... | blank
 *   head    = { magic, number of this page, its complement, 0 }                          one unit
 *   record  = label | value | the same label with another mark
 *   label   = { mark and key, byte count, CRC of both, 0 }                               one unit
 *
 * Everything is written once, in units of 16 bytes, and nothing is changed but by erasing a page. A new value
 * is a new record behind the others; it counts when its second label is begun, which is written last. When a
 * page is full, the newest value of every key goes to the other page, and that page's heads, written last,
 * make it the one in force. So a power cut at any moment, even in the middle of a unit, leaves the old or the
 * new value.
 *
 * Whatever must be understood is there twice, so that one damaged unit is either made good by its twin, or is
 * part of a value, whose key is known and whose CRC is the core's. A power cut can only leave an unfinished
 * record behind all others; what follows it goes to the other page. So anything else that cannot be read is
 * damage, and is never passed over in favour of an older value. A third page holds a copy of a damaged one
 * (set_aside). */
#ifndef WIFICNC_PIC32MZ_FLASH_STORE_H
#define WIFICNC_PIC32MZ_FLASH_STORE_H

#include "hal/hal.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    FLASH_LIVE_PAGES = 2,
    FLASH_ASIDE = FLASH_LIVE_PAGES, /* the page of the copy */
    FLASH_PAGES = FLASH_LIVE_PAGES + 1,
    FLASH_PAGE_SIZE = 16384,
    FLASH_UNIT_WORDS = 4,
    FLASH_UNIT_SIZE = 16,
    FLASH_UNITS = FLASH_PAGE_SIZE / FLASH_UNIT_SIZE,
    FLASH_KEYS = 16, /* keys are 0 .. 15 */
};

struct flash_ops {
    /** All pages, one behind the other, as they are now: no cache in between. */
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
