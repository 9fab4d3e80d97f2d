/* SPDX-License-Identifier: MIT */
#include "store/flash_store.h"

#include "settings/store.h"
#include "store/flash_page.h"

#include <string.h>

_Static_assert(STORE_BATCH_SIZE <= sizeof(((struct flash_work *)0)->bytes), "a batch can be laid out");

static size_t load(const void *ctx, uint8_t key, void *bytes, size_t size) {
    const struct flash_store *store = ctx;
    struct flash_record found[FLASH_KEYS];
    flash_find(store, flash_page_in_force(store), found);
    const struct flash_record *at = &found[key % FLASH_KEYS];
    if (at->kind == FLASH_KIND_END)
        return 0;
    if (at->kind == FLASH_KIND_UNREADABLE) {
        /* One byte is no sound value: the core reports it as damaged, not as absent. */
        *(uint8_t *)bytes = 0;
        return 1;
    }
    size_t count = at->label.count < size ? at->label.count : size;
    for (size_t i = 0; i < count; i++)
        ((uint8_t *)bytes)[i] =
            (uint8_t)(flash_word(store, at->page, at->unit + 1, (unsigned)(i / 4)) >> i % 4 * 8);
    return count;
}

/* ---- laying a write out in RAM ---- */

static void put(struct flash_work *work, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    const uint32_t words[FLASH_UNIT_WORDS] = {a, b, c, d};
    memcpy(work->units[work->end++], words, sizeof words);
}

static uint32_t word_of(const uint8_t *bytes, size_t count, size_t at) {
    uint32_t word = FLASH_BLANK;
    if (at < count)
        memcpy(&word, bytes + at, count - at < 4 ? count - at : 4);
    return word;
}

static void put_label(struct flash_work *work, uint32_t magic, const struct flash_label *label) {
    put(work, magic | label->key, label->count, flash_label_check(magic, label), 0);
}

static bool has_room(const struct flash_work *work, size_t count) {
    return work->end + flash_record_units((uint32_t)count) <= FLASH_UNITS;
}

static bool put_record(struct flash_work *work, const struct hal_store_value *value) {
    const struct flash_label label = {.key = value->key, .count = (uint32_t)value->count};
    const uint8_t *bytes = value->bytes;
    const size_t count = value->count;
    if (!has_room(work, count))
        return false;
    put_label(work, FLASH_RECORD_MAGIC, &label);
    for (size_t at = 0; at < count; at += FLASH_UNIT_SIZE)
        put(work, word_of(bytes, count, at), word_of(bytes, count, at + 4), word_of(bytes, count, at + 8),
            word_of(bytes, count, at + 12));
    put_label(work, FLASH_SEAL_MAGIC, &label);
    return true;
}

static bool put_values(struct flash_work *work) {
    for (size_t i = 0; i < work->count; i++)
        if (!put_record(work, &work->values[i]))
            return false;
    return true;
}

static void put_copy(const struct flash_store *store, unsigned page, unsigned unit) {
    put(store->work, flash_word(store, page, unit, 0), flash_word(store, page, unit, 1),
        flash_word(store, page, unit, 2), flash_word(store, page, unit, 3));
}

/* Labels are made good, the value stays as it is: one that is damaged stays so. */
static bool copy_record(const struct flash_store *store, const struct flash_record *from) {
    static const uint8_t nothing = 0;
    const struct hal_store_value lost = {.key = (uint8_t)from->label.key, .bytes = &nothing, .count = 1};
    struct flash_work *work = store->work;
    if (from->kind == FLASH_KIND_UNREADABLE)
        return put_record(work, &lost);
    if (!has_room(work, from->label.count))
        return false;
    put_label(work, FLASH_RECORD_MAGIC, &from->label);
    for (unsigned i = 1; i <= flash_value_units(from->label.count); i++)
        put_copy(store, from->page, from->unit + i);
    put_label(work, FLASH_SEAL_MAGIC, &from->label);
    return true;
}

static bool is_among(const struct flash_work *work, uint8_t key) {
    for (size_t i = 0; i < work->count; i++)
        if (work->values[i].key == key)
            return true;
    return false;
}

static void put_heads(struct flash_work *work, uint32_t number) {
    const uint32_t head[FLASH_UNIT_WORDS] = {FLASH_PAGE_MAGIC, number, ~number, 0};
    for (unsigned unit = 0; unit < FLASH_HEAD_UNITS; unit++)
        memcpy(work->units[unit], head, sizeof head);
}

/* The other page takes the newest values, these among them, and is in force once its heads are written. */
static bool lay_out_other_page(const struct flash_store *store) {
    struct flash_work *work = store->work;
    struct flash_record found[FLASH_KEYS];
    unsigned page = flash_page_in_force(store);
    flash_find(store, page, found);
    work->page = page == 0 ? 1 : 0;
    work->unit = work->end = FLASH_HEAD_UNITS;
    work->erases = work->heads = true;
    work->appends = work->writes = false;
    for (uint8_t key = 0; key < FLASH_KEYS; key++)
        if (!is_among(work, key) && found[key].kind != FLASH_KIND_END && !copy_record(store, &found[key]))
            return false;
    put_heads(work, page == FLASH_NO_PAGE ? 1 : flash_page_number(store, page) + 1);
    return put_values(work);
}

/* One value goes after the others, while there is room and nothing is damaged. */
static bool lay_out_append(const struct flash_store *store) {
    struct flash_work *work = store->work;
    unsigned page = flash_page_in_force(store);
    if (work->count != 1 || !flash_is_clean(store, page))
        return false;
    unsigned end = flash_end(store, page);
    work->page = page;
    work->unit = work->end = end < FLASH_HEAD_UNITS ? FLASH_HEAD_UNITS : end;
    work->erases = work->heads = work->writes = false;
    work->appends = true;
    return put_values(work);
}

static bool take_values(struct flash_work *work, const struct hal_store_value *values, size_t count) {
    work->count = work->bytes_used = 0;
    for (size_t i = 0; i < count; i++) {
        if (values[i].key >= FLASH_KEYS || is_among(work, values[i].key) ||
            values[i].count > sizeof work->bytes - work->bytes_used)
            return false;
        uint8_t *bytes = work->bytes + work->bytes_used;
        memcpy(bytes, values[i].bytes, values[i].count);
        work->values[work->count++] =
            (struct hal_store_value){.key = values[i].key, .bytes = bytes, .count = values[i].count};
        work->bytes_used += values[i].count;
    }
    return count > 0;
}

/* ---- carrying it out ---- */

/* @return false: that was all */
static bool begin_next(const struct flash_store *store) {
    struct flash_work *work = store->work;
    if (work->erases) {
        store->ops->erase(store->ctx, work->page);
        return true;
    }
    /* The heads last: until they are there a power cut leaves the page before in force, and nothing is
     * lost. */
    if (work->unit == work->end && work->heads) {
        work->unit = 0;
        work->end = FLASH_HEAD_UNITS;
        work->heads = false;
    }
    if (work->unit == work->end)
        return false;
    store->ops->program(store->ctx, work->page, work->unit, work->units[work->unit]);
    work->writes = true;
    return true;
}

/* Read back, because the controller reports only errors that it notices itself. */
static bool is_as_written(const struct flash_store *store) {
    const struct flash_work *work = store->work;
    for (unsigned word = 0; work->writes && word < FLASH_UNIT_WORDS; word++)
        if (flash_word(store, work->page, work->unit, word) != work->units[work->unit][word])
            return false;
    return true;
}

/* A unit that cannot be written does not end the write: the other page is erased and takes all of it. */
static enum hal_store_state fail(const struct flash_store *store) {
    bool again = store->work->appends && lay_out_other_page(store) && begin_next(store);
    return again ? HAL_STORE_BUSY : HAL_STORE_FAILED;
}

bool flash_store_poll(const struct flash_store *store) {
    struct flash_work *work = store->work;
    if (work->state != HAL_STORE_BUSY)
        return false;
    enum hal_store_state operation = store->ops->state(store->ctx);
    if (operation == HAL_STORE_BUSY)
        return true;
    if (operation == HAL_STORE_FAILED || !is_as_written(store)) {
        work->state = fail(store);
        return true;
    }
    work->unit += work->writes ? 1 : 0;
    work->erases = work->writes = false;
    work->state = begin_next(store) ? HAL_STORE_BUSY : HAL_STORE_DONE;
    return true;
}

static enum hal_store_state save(const void *ctx, const struct hal_store_value *values, size_t count) {
    const struct flash_store *store = ctx;
    struct flash_work *work = store->work;
    bool good = take_values(work, values, count) && (lay_out_append(store) || lay_out_other_page(store)) &&
                begin_next(store);
    work->state = good ? HAL_STORE_BUSY : HAL_STORE_FAILED;
    return work->state;
}

static enum hal_store_state set_aside(const void *ctx) {
    const struct flash_store *store = ctx;
    struct flash_work *work = store->work;
    unsigned page = flash_page_in_force(store);
    if (page == FLASH_NO_PAGE)
        page = flash_is_blank(store, 0, 1) ? 1 : 0;
    memset(work, 0, sizeof *work);
    work->page = FLASH_ASIDE;
    work->erases = true;
    work->state = HAL_STORE_BUSY;
    unsigned end = flash_end(store, page);
    for (unsigned unit = 0; unit < end; unit++)
        put_copy(store, page, unit);
    (void)begin_next(store);
    return work->state;
}

static enum hal_store_state state(const void *ctx) {
    const struct flash_store *store = ctx;
    return store->work->state;
}

const struct hal_store flash_hal_store = {.load = load, .save = save, .set_aside = set_aside, .state = state};
