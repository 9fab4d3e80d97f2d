/* SPDX-License-Identifier: MIT
 * Reading the pages of flash_store.h: which page is in force, and the newest value of each key in it. */
#ifndef WIFICNC_PIC32MZ_FLASH_PAGE_H
#define WIFICNC_PIC32MZ_FLASH_PAGE_H

#include "store/flash_store.h"

#define FLASH_PAGE_MAGIC   0x32474657u /* "WFG2" */
#define FLASH_RECORD_MAGIC 0x5EC00000u /* key in the low byte */
#define FLASH_SEAL_MAGIC   0x5EA10000u
#define FLASH_BLANK        0xFFFFFFFFu

enum { FLASH_NO_PAGE = FLASH_LIVE_PAGES, FLASH_HEAD_UNITS = 2, FLASH_VALUE_MAX = FLASH_PAGE_SIZE / 4 };

/* What comes before and after a value. */
struct flash_label {
    uint32_t key, count;
};

/* What begins at a unit of the page in force. */
enum flash_kind {
    FLASH_KIND_RECORD,     /* `whole`: both labels are sound. Its value is for the core to check */
    FLASH_KIND_UNREADABLE, /* one unit of unknown content */
    FLASH_KIND_BLANK,      /* one unit, and something is after it */
    FLASH_KIND_UNFINISHED, /* a record that a power cut has ended; nothing is after it */
    FLASH_KIND_END,
};
struct flash_record {
    enum flash_kind kind;
    bool whole;
    unsigned page, unit, end; /* end: flash_end() of the page */
    struct flash_label label;
};

uint32_t flash_word(const struct flash_store *store, unsigned page, unsigned unit, unsigned word);
bool flash_is_blank(const struct flash_store *store, unsigned page, unsigned unit);

/** The first unit after everything that was ever written to the page. */
unsigned flash_end(const struct flash_store *store, unsigned page);

/** Units of a value of so many bytes. */
unsigned flash_value_units(uint32_t count);

/** Units of a whole record: label, value, label. */
unsigned flash_record_units(uint32_t count);

uint32_t flash_label_check(uint32_t magic, const struct flash_label *label);

/** The page in force, or FLASH_NO_PAGE. */
unsigned flash_page_in_force(const struct flash_store *store);

/** Its number: higher than that of the page before it. */
uint32_t flash_page_number(const struct flash_store *store, unsigned page);

/** The newest value of each key. FLASH_KIND_END: it has none; FLASH_KIND_UNREADABLE: it is not known whether
 * it has one. */
void flash_find(const struct flash_store *store, unsigned page, struct flash_record found[FLASH_KEYS]);

/** The page is of this layout, and nothing of it is damaged or unfinished: it can be written on. */
bool flash_is_clean(const struct flash_store *store, unsigned page);

/** Layout 1, of firmware up to November 2026: "WFG1". It is only read; the next write goes to the other page.
 *   page = head | record | record ...
 *   record = { mark and key, byte count, CRC of both and the value, 0 } | value | { seal, CRC } */
bool flash_1_is_page(const struct flash_store *store, unsigned page);
void flash_1_find(const struct flash_store *store, unsigned page, struct flash_record found[FLASH_KEYS]);

#endif
