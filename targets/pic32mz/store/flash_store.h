/* SPDX-License-Identifier: MIT
 * What the core keeps (hal_store), in pages of flash. [task] No register here: the flash is ops.
 *
 *   page    = head | the same head again | record | record | ... | blank
 *   head    = { magic, number of this page, its complement, 0 }                          one unit
 *   record  = label | value | the same label with another mark
 *   label   = { mark and key, byte count, CRC of both, 0 }                               one unit
 *
 * Everything is written once, in units of 16 bytes, and nothing is changed but by erasing a page. A new value
 * is a new record after the others; it counts when its second label is begun, which is written last. When a
 * page is full, the newest value of every key goes to the other page, and that page's heads, written last,
 * make it the one in force. So a power cut at any moment, even in the middle of a unit, leaves the old or the
 * new value. Several values in one step always go to the other page: its heads bring all of them into force.
 *
 * Whatever must be understood is there twice, so that one damaged unit is either made good by its twin, or is
 * part of a value, whose key is known and whose CRC is the core's. A power cut can only leave an unfinished
 * record behind all others; what follows it goes to the other page. So anything else that cannot be read is
 * damage, and is never passed over in favour of an older value. A third page holds a copy of a damaged one
 * (set_aside).
 *
 * A write is laid out in RAM first (struct flash_work), and flash_store_poll() then has one operation after
 * the other carried out, without waiting for any of them. */
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

/** Each operation is begun and takes its time; no other one is begun before state() is not busy any more. */
struct flash_ops {
    /** All pages, one after the other, as they are now: no cache in between. Not read while it is busy. */
    const volatile uint32_t *words;
    /** Whole page to 1. */
    void (*erase)(void *ctx, unsigned page);
    /** A unit that is all 1. */
    void (*program)(void *ctx, unsigned page, unsigned unit, const uint32_t words[FLASH_UNIT_WORDS]);
    /** The operation begun last. */
    enum hal_store_state (*state)(void *ctx);
};

/** The write that is under way. Begins as zeros at every start of the chip. */
struct flash_work {
    enum hal_store_state state;
    unsigned page;            /* where it is written */
    unsigned unit, end;       /* next unit, and the one after the last */
    bool erases, heads;       /* the page is erased first; its heads are written last */
    bool writes;              /* an operation for `unit` is under way */
    bool appends;             /* to the page in force: if that fails, the other page is tried */
    size_t count, bytes_used; /* of the values */
    struct hal_store_value values[FLASH_KEYS];
    uint8_t bytes[FLASH_PAGE_SIZE / 4];
    uint32_t units[FLASH_UNITS][FLASH_UNIT_WORDS]; /* the page as it is to be; of it, unit .. end - 1 */
};

struct flash_store {
    const struct flash_ops *ops;
    void *ctx;
    struct flash_work *work;
};

/** ctx is a struct flash_store. */
extern const struct hal_store flash_hal_store;

/** [task] When the operation under way has ended: check it and begin the next one. Never waits.
 * @return true while a write is under way */
bool flash_store_poll(const struct flash_store *store);

#endif
