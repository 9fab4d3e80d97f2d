/* SPDX-License-Identifier: MIT */
#include "store/flash_store.h"

#include <string.h>

#define PAGE_MAGIC   0x32474657u /* "WFG2" */
#define RECORD_MAGIC 0x5EC00000u /* key in the low byte */
#define SEAL_MAGIC   0x5EA10000u
#define BLANK        0xFFFFFFFFu
#define NO_PAGE      FLASH_LIVE_PAGES

enum { HEAD_UNITS = 2, VALUE_MAX = FLASH_PAGE_SIZE / 4 };

/* What stands before and behind a value. */
struct label {
    uint32_t key, count;
};

/* What begins at a unit of the page in force. */
enum kind {
    KIND_RECORD,     /* `whole`: both labels are sound. Its value is for the core to check */
    KIND_UNREADABLE, /* one unit of nobody knows what */
    KIND_BLANK,      /* one unit, and something is behind it */
    KIND_UNFINISHED, /* a record that a power cut has ended; nothing is behind it */
    KIND_END,
};
struct record {
    enum kind kind;
    bool whole;
    unsigned page, unit, end; /* end: end_of() the page */
    struct label label;
};

/* ---- units ---- */

static uint32_t word_at(const struct flash_store *store, unsigned page, unsigned unit, unsigned word) {
    return store->ops->words[(page * FLASH_UNITS + unit) * FLASH_UNIT_WORDS + word];
}

static bool is_blank(const struct flash_store *store, unsigned page, unsigned unit) {
    for (unsigned word = 0; word < FLASH_UNIT_WORDS; word++)
        if (word_at(store, page, unit, word) != BLANK)
            return false;
    return true;
}

/* The first unit behind everything that was ever written to the page. */
static unsigned end_of(const struct flash_store *store, unsigned page) {
    unsigned unit = FLASH_UNITS;
    while (unit > 0 && is_blank(store, page, unit - 1))
        unit--;
    return unit;
}

static uint32_t crc_word(uint32_t crc, uint32_t word) {
    crc ^= word;
    for (int bit = 0; bit < 32; bit++)
        crc = crc >> 1 ^ (0xEDB88320u & (0u - (crc & 1u)));
    return crc;
}

static unsigned units_of(uint32_t count) {
    return (unsigned)((count + FLASH_UNIT_SIZE - 1) / FLASH_UNIT_SIZE);
}

/* Units of a whole record: label, value, label. */
static unsigned record_units(uint32_t count) {
    return units_of(count) + 2;
}

static uint32_t label_check(uint32_t magic, const struct label *label) {
    return crc_word(crc_word(BLANK, magic | label->key), label->count);
}

/* ---- pages ---- */

static bool is_head(const struct flash_store *store, unsigned page, unsigned unit) {
    return word_at(store, page, unit, 0) == PAGE_MAGIC &&
           word_at(store, page, unit, 1) == ~word_at(store, page, unit, 2);
}

static bool is_page(const struct flash_store *store, unsigned page) {
    return is_head(store, page, 0) || is_head(store, page, 1);
}

static uint32_t page_number(const struct flash_store *store, unsigned page) {
    return word_at(store, page, is_head(store, page, 0) ? 0 : 1, 1);
}

/* The page in force, or NO_PAGE. */
static unsigned page_in_force(const struct flash_store *store) {
    bool first = is_page(store, 0), second = is_page(store, 1);
    if (first && second)
        return (int32_t)(page_number(store, 1) - page_number(store, 0)) > 0 ? 1 : 0;
    return first ? 0 : second ? 1 : NO_PAGE;
}

/* No page is in force, and one was: a power cut that came before the second head leaves that blank. */
static bool has_lost_page(const struct flash_store *store) {
    for (unsigned page = 0; page < FLASH_LIVE_PAGES; page++)
        if (!is_blank(store, page, 1))
            return true;
    return false;
}

/* ---- records ---- */

static bool read_label(const struct flash_store *store, unsigned page, unsigned unit, uint32_t magic,
                       struct label *label) {
    if (unit >= FLASH_UNITS)
        return false;
    *label =
        (struct label){.key = word_at(store, page, unit, 0) & 0xFFu, .count = word_at(store, page, unit, 1)};
    return word_at(store, page, unit, 0) == (magic | label->key) && label->count <= VALUE_MAX &&
           word_at(store, page, unit, 2) == label_check(magic, label);
}

/* Its first label is damaged: the second one says where it began. */
static bool find_by_seal(const struct flash_store *store, struct record *at) {
    for (unsigned unit = at->unit + 1; unit < at->end; unit++)
        if (read_label(store, at->page, unit, SEAL_MAGIC, &at->label))
            return unit + 1 == at->unit + record_units(at->label.count);
    return false;
}

static struct record record_at(const struct flash_store *store, unsigned page, unsigned unit, unsigned end) {
    struct record at = {.kind = KIND_UNREADABLE, .page = page, .unit = unit, .end = end};
    struct label label;
    if (unit >= end) {
        at.kind = KIND_END;
    } else if (is_blank(store, page, unit)) {
        at.kind = KIND_BLANK;
    } else if (read_label(store, page, unit, RECORD_MAGIC, &at.label)) {
        unsigned seal = unit + 1 + units_of(at.label.count);
        at.whole = read_label(store, page, seal, SEAL_MAGIC, &label);
        at.kind = seal >= end ? KIND_UNFINISHED : KIND_RECORD;
    } else if (find_by_seal(store, &at)) {
        at.kind = KIND_RECORD;
    } else if (unit + 1 == end) {
        at.kind = KIND_UNFINISHED;
    }
    return at;
}

static struct record first_record(const struct flash_store *store, unsigned page) {
    return record_at(store, page, HEAD_UNITS, end_of(store, page));
}

/* @return false: that was the last one */
static bool next_record(const struct flash_store *store, struct record *at) {
    if (at->kind == KIND_END || at->kind == KIND_UNFINISHED)
        return false;
    unsigned units = at->kind == KIND_RECORD ? record_units(at->label.count) : 1;
    *at = record_at(store, at->page, at->unit + units, at->end);
    return true;
}

/* The newest value of a key: KIND_END: it has none; KIND_UNREADABLE: it is not known whether it has one. */
static struct record find(const struct flash_store *store, unsigned page, uint8_t key) {
    struct record found = {.kind = KIND_END, .page = page};
    if (page == NO_PAGE) {
        found.kind = has_lost_page(store) ? KIND_UNREADABLE : KIND_END;
        return found;
    }
    struct record at = first_record(store, page);
    do {
        bool own = at.kind == KIND_RECORD && at.label.key == key;
        if (own || at.kind == KIND_UNREADABLE)
            found = at;
    } while (next_record(store, &at));
    return found;
}

static size_t load(const void *ctx, uint8_t key, void *bytes, size_t size) {
    const struct flash_store *store = ctx;
    struct record at = find(store, page_in_force(store), key);
    if (at.kind == KIND_END)
        return 0;
    if (at.kind == KIND_UNREADABLE) {
        *(uint8_t *)bytes = 0;
        return 1;
    }
    size_t count = at.label.count < size ? at.label.count : size;
    for (size_t i = 0; i < count; i++)
        ((uint8_t *)bytes)[i] =
            (uint8_t)(word_at(store, at.page, at.unit + 1, (unsigned)(i / 4)) >> i % 4 * 8);
    return count;
}

/* ---- writing ---- */

/* Where the next unit goes. `good` becomes false at the first failure, and then nothing more is written. */
struct pen {
    const struct flash_store *store;
    unsigned page, unit;
    bool good;
};

static void put(struct pen *pen, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    const uint32_t words[FLASH_UNIT_WORDS] = {a, b, c, d};
    const struct flash_store *store = pen->store;
    pen->good = pen->good && store->ops->program(store->ctx, pen->page, pen->unit, words);
    for (unsigned word = 0; word < FLASH_UNIT_WORDS; word++)
        pen->good = pen->good && word_at(store, pen->page, pen->unit, word) == words[word];
    pen->unit++;
}

static uint32_t word_of(const uint8_t *bytes, size_t count, size_t at) {
    uint32_t word = BLANK;
    if (at < count)
        memcpy(&word, bytes + at, count - at < 4 ? count - at : 4);
    return word;
}

static void put_label(struct pen *pen, uint32_t magic, const struct label *label) {
    put(pen, magic | label->key, label->count, label_check(magic, label), 0);
}

static void put_record(struct pen *pen, uint8_t key, const uint8_t *bytes, uint32_t count) {
    const struct label label = {.key = key, .count = count};
    put_label(pen, RECORD_MAGIC, &label);
    for (size_t at = 0; at < units_of(count) * FLASH_UNIT_SIZE; at += FLASH_UNIT_SIZE)
        put(pen, word_of(bytes, count, at), word_of(bytes, count, at + 4), word_of(bytes, count, at + 8),
            word_of(bytes, count, at + 12));
    put_label(pen, SEAL_MAGIC, &label);
}

static void copy_unit(struct pen *pen, unsigned page, unsigned unit) {
    put(pen, word_at(pen->store, page, unit, 0), word_at(pen->store, page, unit, 1),
        word_at(pen->store, page, unit, 2), word_at(pen->store, page, unit, 3));
}

/* Labels are made good, the value stays as it is: one that is damaged stays so. */
static void copy_record(struct pen *pen, const struct record *from) {
    static const uint8_t lost = 0;
    if (from->kind == KIND_UNREADABLE) {
        put_record(pen, (uint8_t)from->label.key, &lost, 1);
        return;
    }
    put_label(pen, RECORD_MAGIC, &from->label);
    for (unsigned i = 1; i <= units_of(from->label.count); i++)
        copy_unit(pen, from->page, from->unit + i);
    put_label(pen, SEAL_MAGIC, &from->label);
}

/* The other page takes the newest values, this one among them, and is in force when its head stands. */
static bool save_to_other_page(const struct flash_store *store, unsigned page, uint8_t key,
                               const uint8_t *bytes, uint32_t count) {
    uint32_t number = page == NO_PAGE ? 1 : page_number(store, page) + 1;
    struct pen pen = {.store = store, .page = page == 0 ? 1 : 0, .unit = HEAD_UNITS, .good = true};
    if (!store->ops->erase(store->ctx, pen.page))
        return false;
    for (uint8_t other = 0; other < FLASH_KEYS; other++) {
        struct record at = find(store, page, other);
        at.label.key = other;
        if (other == key || at.kind == KIND_END)
            continue;
        if (pen.unit + record_units(at.kind == KIND_UNREADABLE ? 1 : at.label.count) > FLASH_UNITS)
            return false;
        copy_record(&pen, &at);
    }
    if (pen.unit + record_units(count) > FLASH_UNITS)
        return false;
    put_record(&pen, key, bytes, count);
    for (pen.unit = 0; pen.unit < HEAD_UNITS;)
        put(&pen, PAGE_MAGIC, number, ~number, 0);
    return pen.good;
}

/* Nothing of it is damaged or unfinished: it can be written on. */
static bool is_clean(const struct flash_store *store, unsigned page) {
    if (page == NO_PAGE || !is_head(store, page, 0) || !is_head(store, page, 1))
        return false;
    struct record at = first_record(store, page);
    while (at.kind == KIND_RECORD && at.whole)
        (void)next_record(store, &at);
    return at.kind == KIND_END;
}

static bool save(const void *ctx, uint8_t key, const void *bytes, size_t count) {
    const struct flash_store *store = ctx;
    unsigned page = page_in_force(store);
    if (key >= FLASH_KEYS || count > VALUE_MAX)
        return false;
    if (is_clean(store, page)) {
        struct pen pen = {.store = store, .page = page, .unit = end_of(store, page), .good = true};
        pen.unit = pen.unit < HEAD_UNITS ? HEAD_UNITS : pen.unit;
        if (pen.unit + record_units((uint32_t)count) <= FLASH_UNITS) {
            put_record(&pen, key, bytes, (uint32_t)count);
            if (pen.good)
                return true;
        }
    }
    return save_to_other_page(store, page, key, bytes, (uint32_t)count);
}

static bool set_aside(const void *ctx) {
    const struct flash_store *store = ctx;
    unsigned page = page_in_force(store);
    struct pen pen = {.store = store, .page = FLASH_ASIDE, .good = true};
    if (page == NO_PAGE)
        page = is_blank(store, 0, 1) ? 1 : 0;
    pen.good = store->ops->erase(store->ctx, FLASH_ASIDE);
    for (unsigned unit = 0; unit < FLASH_UNITS; unit++) {
        pen.unit = unit;
        if (!is_blank(store, page, unit))
            copy_unit(&pen, page, unit);
    }
    return pen.good;
}

const struct hal_store flash_hal_store = {.load = load, .save = save, .set_aside = set_aside};
