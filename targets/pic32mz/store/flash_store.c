/* SPDX-License-Identifier: MIT */
#include "store/flash_store.h"

#include <string.h>

#define PAGE_MAGIC   0x31474657u /* "WFG1" */
#define RECORD_MAGIC 0x5EC00000u /* key in the low byte */
#define SEAL_MAGIC   0x5EA1ED00u
#define BLANK        0xFFFFFFFFu
#define NO_PAGE      FLASH_PAGES

/* A record as it lies in the page in force. unit 0 = there is none. */
struct place {
    unsigned page, unit;
    uint32_t count, crc;
};

/* ---- reading ---- */

static uint32_t word_at(const struct flash_store *store, unsigned page, unsigned unit, unsigned word) {
    return store->ops->words[(page * FLASH_UNITS + unit) * FLASH_UNIT_WORDS + word];
}

static bool is_blank(const struct flash_store *store, unsigned page, unsigned unit) {
    for (unsigned word = 0; word < FLASH_UNIT_WORDS; word++)
        if (word_at(store, page, unit, word) != BLANK)
            return false;
    return true;
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

/* Units of a whole record: head, value, seal. */
static unsigned record_units(uint32_t count) {
    return units_of(count) + 2;
}

static bool is_page(const struct flash_store *store, unsigned page) {
    return word_at(store, page, 0, 0) == PAGE_MAGIC &&
           word_at(store, page, 0, 1) == ~word_at(store, page, 0, 2);
}

/* The page in force, or NO_PAGE. */
static unsigned page_in_force(const struct flash_store *store) {
    bool first = is_page(store, 0), second = is_page(store, 1);
    if (first && second)
        return (int32_t)(word_at(store, 1, 0, 1) - word_at(store, 0, 0, 1)) > 0 ? 1 : 0;
    return first ? 0 : second ? 1 : NO_PAGE;
}

/* A record begins here, whole or not. */
static bool is_record(const struct flash_store *store, unsigned page, unsigned unit) {
    uint32_t count = word_at(store, page, unit, 1);
    return (word_at(store, page, unit, 0) & ~0xFFu) == RECORD_MAGIC && count <= FLASH_PAGE_SIZE &&
           unit + record_units(count) <= FLASH_UNITS;
}

static struct place place_at(const struct flash_store *store, unsigned page, unsigned unit) {
    return (struct place){.page = page,
                          .unit = unit,
                          .count = word_at(store, page, unit, 1),
                          .crc = word_at(store, page, unit, 2)};
}

/* Its seal stands: it was written to its end. */
static bool is_sealed(const struct flash_store *store, const struct place *at) {
    unsigned seal = at->unit + 1 + units_of(at->count);
    return word_at(store, at->page, seal, 0) == SEAL_MAGIC && word_at(store, at->page, seal, 1) == at->crc;
}

static bool is_sound(const struct flash_store *store, const struct place *at) {
    uint32_t crc = crc_word(crc_word(BLANK, word_at(store, at->page, at->unit, 0)), at->count);
    for (unsigned i = 0; i < units_of(at->count) * FLASH_UNIT_WORDS; i++)
        crc = crc_word(crc, word_at(store, at->page, at->unit + 1, i));
    return crc == at->crc;
}

/* The newest sealed record of a key that begins before a unit. What is no record is passed over. */
static struct place find_before(const struct flash_store *store, unsigned page, uint8_t key, unsigned end) {
    struct place found = {.page = page};
    for (unsigned unit = 1; unit < end;) {
        struct place at = place_at(store, page, unit);
        bool sealed = is_record(store, page, unit) && is_sealed(store, &at);
        if (sealed && word_at(store, page, unit, 0) == (RECORD_MAGIC | key))
            found = at;
        unit += sealed ? record_units(at.count) : 1;
    }
    return found;
}

/* The newest value of a key; one that is damaged does not count. */
static struct place find(const struct flash_store *store, unsigned page, uint8_t key) {
    struct place at = {.page = page};
    if (page == NO_PAGE)
        return at;
    at = find_before(store, page, key, FLASH_UNITS);
    while (at.unit != 0 && !is_sound(store, &at))
        at = find_before(store, page, key, at.unit);
    return at;
}

/* The first unit behind everything that was ever written to the page. */
static unsigned end_of(const struct flash_store *store, unsigned page) {
    unsigned unit = FLASH_UNITS;
    while (unit > 0 && is_blank(store, page, unit - 1))
        unit--;
    return unit;
}

static size_t load(const void *ctx, uint8_t key, void *bytes, size_t size) {
    const struct flash_store *store = ctx;
    struct place at = find(store, page_in_force(store), key);
    if (at.unit == 0)
        return 0;
    size_t count = at.count < size ? at.count : size;
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

static void put_record(struct pen *pen, uint8_t key, const uint8_t *bytes, uint32_t count) {
    uint32_t crc = crc_word(crc_word(BLANK, RECORD_MAGIC | key), count);
    unsigned units = units_of(count);
    for (size_t at = 0; at < units * FLASH_UNIT_SIZE; at += 4)
        crc = crc_word(crc, word_of(bytes, count, at));
    put(pen, RECORD_MAGIC | key, count, crc, 0);
    for (size_t at = 0; at < units * FLASH_UNIT_SIZE; at += FLASH_UNIT_SIZE)
        put(pen, word_of(bytes, count, at), word_of(bytes, count, at + 4), word_of(bytes, count, at + 8),
            word_of(bytes, count, at + 12));
    put(pen, SEAL_MAGIC, crc, 0, 0);
}

static void copy_record(struct pen *pen, const struct place *from) {
    for (unsigned i = 0; i < record_units(from->count); i++) {
        uint32_t words[FLASH_UNIT_WORDS];
        for (unsigned word = 0; word < FLASH_UNIT_WORDS; word++)
            words[word] = word_at(pen->store, from->page, from->unit + i, word);
        put(pen, words[0], words[1], words[2], words[3]);
    }
}

/* The other page takes the newest values, this one among them, and is in force when its head stands. */
static bool save_to_other_page(const struct flash_store *store, unsigned page, uint8_t key,
                               const uint8_t *bytes, uint32_t count) {
    uint32_t number = page == NO_PAGE ? 1 : word_at(store, page, 0, 1) + 1;
    struct pen pen = {.store = store, .page = page == 0 ? 1 : 0, .unit = 1, .good = true};
    if (!store->ops->erase(store->ctx, pen.page))
        return false;
    for (uint8_t other = 0; other < FLASH_KEYS; other++) {
        struct place at = find(store, page, other);
        if (other != key && at.unit != 0 && pen.unit + record_units(at.count) <= FLASH_UNITS)
            copy_record(&pen, &at);
    }
    if (pen.unit + record_units(count) > FLASH_UNITS)
        return false;
    put_record(&pen, key, bytes, count);
    pen.unit = 0;
    put(&pen, PAGE_MAGIC, number, ~number, 0);
    return pen.good;
}

static bool save(const void *ctx, uint8_t key, const void *bytes, size_t count) {
    const struct flash_store *store = ctx;
    unsigned page = page_in_force(store);
    if (key >= FLASH_KEYS || count > FLASH_PAGE_SIZE / 4)
        return false;
    struct pen pen = {.store = store, .page = page, .good = true};
    if (page != NO_PAGE)
        pen.unit = end_of(store, page);
    if (page != NO_PAGE && pen.unit + record_units((uint32_t)count) <= FLASH_UNITS)
        put_record(&pen, key, bytes, (uint32_t)count);
    else
        pen.good = false;
    return pen.good || save_to_other_page(store, page, key, bytes, (uint32_t)count);
}

const struct hal_store flash_hal_store = {.load = load, .save = save};
