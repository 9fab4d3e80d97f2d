/* SPDX-License-Identifier: MIT */
#include "store/flash_page.h"

/* ---- units ---- */

uint32_t flash_word(const struct flash_store *store, unsigned page, unsigned unit, unsigned word) {
    return store->ops->words[(page * FLASH_UNITS + unit) * FLASH_UNIT_WORDS + word];
}

bool flash_is_blank(const struct flash_store *store, unsigned page, unsigned unit) {
    for (unsigned word = 0; word < FLASH_UNIT_WORDS; word++)
        if (flash_word(store, page, unit, word) != FLASH_BLANK)
            return false;
    return true;
}

unsigned flash_end(const struct flash_store *store, unsigned page) {
    unsigned unit = FLASH_UNITS;
    while (unit > 0 && flash_is_blank(store, page, unit - 1))
        unit--;
    return unit;
}

static uint32_t crc_word(uint32_t crc, uint32_t word) {
    crc ^= word;
    for (int bit = 0; bit < 32; bit++)
        crc = crc >> 1 ^ (0xEDB88320u & (0u - (crc & 1u)));
    return crc;
}

unsigned flash_value_units(uint32_t count) {
    return (unsigned)((count + FLASH_UNIT_SIZE - 1) / FLASH_UNIT_SIZE);
}

unsigned flash_record_units(uint32_t count) {
    return flash_value_units(count) + 2;
}

uint32_t flash_label_check(uint32_t magic, const struct flash_label *label) {
    return crc_word(crc_word(FLASH_BLANK, magic | label->key), label->count);
}

/* ---- pages ---- */

/* A page has its head twice, in two units: one of them may be damaged by a power cut. */
static bool is_head(const struct flash_store *store, unsigned page, unsigned unit) {
    return flash_word(store, page, unit, 0) == FLASH_PAGE_MAGIC &&
           flash_word(store, page, unit, 1) == ~flash_word(store, page, unit, 2);
}

static bool is_page(const struct flash_store *store, unsigned page) {
    return is_head(store, page, 0) || is_head(store, page, 1);
}

uint32_t flash_page_number(const struct flash_store *store, unsigned page) {
    bool first = is_head(store, page, 0) || flash_1_is_page(store, page);
    return flash_word(store, page, first ? 0 : 1, 1);
}

/* Pages of layout 1 only count while there is none of this one: it was made of them. */
unsigned flash_page_in_force(const struct flash_store *store) {
    bool first = is_page(store, 0), second = is_page(store, 1);
    if (!first && !second) {
        first = flash_1_is_page(store, 0);
        second = flash_1_is_page(store, 1);
    }
    if (first && second)
        /* Numbers wrap, so the newer one is found by the difference. */
        return (int32_t)(flash_page_number(store, 1) - flash_page_number(store, 0)) > 0 ? 1 : 0;
    return first ? 0 : second ? 1 : FLASH_NO_PAGE;
}

/* No page is in force, and one was: a power cut that came before the second head leaves that blank. */
static bool has_lost_page(const struct flash_store *store) {
    for (unsigned page = 0; page < FLASH_LIVE_PAGES; page++)
        if (!flash_is_blank(store, page, 1))
            return true;
    return false;
}

/* ---- records ---- */

static bool read_label(const struct flash_store *store, unsigned page, unsigned unit, uint32_t magic,
                       struct flash_label *label) {
    if (unit >= FLASH_UNITS)
        return false;
    *label = (struct flash_label){.key = flash_word(store, page, unit, 0) & 0xFFu,
                                  .count = flash_word(store, page, unit, 1)};
    return flash_word(store, page, unit, 0) == (magic | label->key) && label->count <= FLASH_VALUE_MAX &&
           flash_word(store, page, unit, 2) == flash_label_check(magic, label);
}

/* Its first label is damaged: the second one says where it began. */
static bool find_by_seal(const struct flash_store *store, struct flash_record *at) {
    for (unsigned unit = at->unit + 1; unit < at->end; unit++)
        if (read_label(store, at->page, unit, FLASH_SEAL_MAGIC, &at->label))
            return unit + 1 == at->unit + flash_record_units(at->label.count);
    return false;
}

static struct flash_record record_at(const struct flash_store *store, unsigned page, unsigned unit,
                                     unsigned end) {
    struct flash_record at = {.kind = FLASH_KIND_UNREADABLE, .page = page, .unit = unit, .end = end};
    struct flash_label label;
    if (unit >= end) {
        at.kind = FLASH_KIND_END;
    } else if (flash_is_blank(store, page, unit)) {
        at.kind = FLASH_KIND_BLANK;
    } else if (read_label(store, page, unit, FLASH_RECORD_MAGIC, &at.label)) {
        unsigned seal = unit + 1 + flash_value_units(at.label.count);
        at.whole = read_label(store, page, seal, FLASH_SEAL_MAGIC, &label);
        at.kind = seal >= end ? FLASH_KIND_UNFINISHED : FLASH_KIND_RECORD;
    } else if (find_by_seal(store, &at)) {
        at.kind = FLASH_KIND_RECORD;
    } else if (unit + 1 == end) {
        at.kind = FLASH_KIND_UNFINISHED;
    }
    return at;
}

static struct flash_record first_record(const struct flash_store *store, unsigned page) {
    return record_at(store, page, FLASH_HEAD_UNITS, flash_end(store, page));
}

/* @return false: that was the last one */
static bool next_record(const struct flash_store *store, struct flash_record *at) {
    if (at->kind == FLASH_KIND_END || at->kind == FLASH_KIND_UNFINISHED)
        return false;
    unsigned units = at->kind == FLASH_KIND_RECORD ? flash_record_units(at->label.count) : 1;
    *at = record_at(store, at->page, at->unit + units, at->end);
    return true;
}

static void find_none(unsigned page, enum flash_kind kind, struct flash_record found[FLASH_KEYS]) {
    for (uint32_t key = 0; key < FLASH_KEYS; key++)
        found[key] = (struct flash_record){.kind = kind, .page = page, .label = {.key = key}};
}

void flash_find(const struct flash_store *store, unsigned page, struct flash_record found[FLASH_KEYS]) {
    bool lost = page == FLASH_NO_PAGE && has_lost_page(store);
    find_none(page, lost ? FLASH_KIND_UNREADABLE : FLASH_KIND_END, found);
    if (page == FLASH_NO_PAGE)
        return;
    if (!is_page(store, page)) {
        flash_1_find(store, page, found);
        return;
    }
    struct flash_record at = first_record(store, page);
    do {
        if (at.kind == FLASH_KIND_RECORD && at.label.key < FLASH_KEYS)
            found[at.label.key] = at;
        else if (at.kind == FLASH_KIND_UNREADABLE)
            find_none(page, FLASH_KIND_UNREADABLE, found);
    } while (next_record(store, &at));
}

bool flash_is_clean(const struct flash_store *store, unsigned page) {
    if (page == FLASH_NO_PAGE || !is_head(store, page, 0) || !is_head(store, page, 1))
        return false;
    struct flash_record at = first_record(store, page);
    while (at.kind == FLASH_KIND_RECORD && at.whole)
        (void)next_record(store, &at);
    return at.kind == FLASH_KIND_END;
}
