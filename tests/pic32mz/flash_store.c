/* SPDX-License-Identifier: MIT
 * The store in flash over a flash that may lose its power at any operation: before it, in its middle, behind
 * it. Usage: flash_store [SHARE], which runs 1/SHARE of the rounds; an odd SHARE flips every bit of a byte.
 */
#include "store/flash_store.h"

#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KEYS = 4, LONGEST = 408, TORN_BEFORE, TORN_AMID, TORN_BEHIND };

static unsigned share = 1; /* of all rounds, 1/share is run */

struct flash {
    uint32_t words[FLASH_PAGES * FLASH_PAGE_SIZE / 4];
    unsigned operations, cut_at; /* 0: never */
    unsigned looks;
    int torn;
    unsigned programmed_twice;
};

static struct flash flash;
static jmp_buf dark;
static unsigned failures;
static uint32_t seed = 1;

static void check(bool good, const char *what, unsigned number) {
    if (!good && failures++ < 20)
        printf("%s (%u)\n", what, number);
}

static uint32_t random_below(uint32_t end) {
    seed = seed * 1664525u + 1013904223u;
    return (uint32_t)((uint64_t)seed * end >> 32);
}

/* ---- a flash ---- */

static void operate(uint32_t *words, const uint32_t *wanted, size_t count) {
    bool cut = ++flash.operations == flash.cut_at;
    for (size_t i = 0; i < count && !(cut && flash.torn == TORN_BEFORE); i++) {
        uint32_t done = cut && flash.torn == TORN_AMID ? random_below(UINT32_MAX) : UINT32_MAX;
        words[i] = (words[i] & ~done) | (wanted[i] & done);
    }
    if (cut)
        longjmp(dark, 1);
}

static void erase(void *ctx, unsigned page) {
    static uint32_t blank[FLASH_PAGE_SIZE / 4];
    struct flash *own = ctx;
    memset(blank, 0xFF, sizeof blank);
    operate(own->words + page * FLASH_PAGE_SIZE / 4, blank, FLASH_PAGE_SIZE / 4);
}

static void program(void *ctx, unsigned page, unsigned unit, const uint32_t words[FLASH_UNIT_WORDS]) {
    struct flash *own = ctx;
    uint32_t *at = own->words + (page * FLASH_UNITS + unit) * FLASH_UNIT_WORDS;
    for (unsigned i = 0; i < FLASH_UNIT_WORDS; i++)
        own->programmed_twice += at[i] != UINT32_MAX;
    operate(at, words, FLASH_UNIT_WORDS);
}

/* Each operation is seen busy twice. */
static enum hal_store_state state(void *ctx) {
    struct flash *own = ctx;
    return ++own->looks % 3 != 0 ? HAL_STORE_BUSY : HAL_STORE_DONE;
}

static struct flash_work work;
static const struct flash_ops ops = {
    .words = flash.words, .erase = erase, .program = program, .state = state};
static const struct flash_store store = {.ops = &ops, .ctx = &flash, .work = &work};

/* @return true: it ended well */
static bool finish(void) {
    while (flash_store_poll(&store)) {
    }
    return flash_hal_store.state(&store) == HAL_STORE_DONE;
}

static bool save_values(const struct hal_store_value *values, size_t count) {
    return flash_hal_store.save(&store, values, count) == HAL_STORE_BUSY && finish();
}

/* ---- what must be there ---- */

struct value {
    size_t count;
    uint8_t bytes[LONGEST];
};

static struct value random_value(void) {
    struct value value = {.count = 1 + random_below(LONGEST)};
    for (size_t i = 0; i < value.count; i++)
        value.bytes[i] = (uint8_t)random_below(256);
    return value;
}

static bool is_stored(uint8_t key, const struct value *value) {
    uint8_t bytes[LONGEST + 1];
    size_t count = flash_hal_store.load(&store, key, bytes, sizeof bytes);
    return count == value->count && memcmp(bytes, value->bytes, count) == 0;
}

static bool save(uint8_t key, const struct value *value) {
    const struct hal_store_value one = {.key = key, .bytes = value->bytes, .count = value->count};
    return save_values(&one, 1);
}

static void values_are_kept_however_many_there_were(void) {
    static struct value kept[KEYS];
    memset(&flash, 0xFF, sizeof flash.words);
    flash.operations = flash.cut_at = 0;
    for (unsigned round = 0; round < 3000 / share; round++) {
        uint8_t key = (uint8_t)random_below(KEYS);
        kept[key] = random_value();
        check(save(key, &kept[key]), "not saved", round);
        for (uint8_t other = 0; other < KEYS; other++)
            check(is_stored(other, &kept[other]), "another value than saved", round);
    }
}

/* Each change is cut somewhere; the key then has its old or its new value, the others theirs. */
static void a_power_cut_leaves_the_old_or_the_new_value(void) {
    static struct value kept[KEYS];
    memset(&flash, 0xFF, sizeof flash.words);
    memset(kept, 0, sizeof kept);
    for (volatile unsigned round = 0; round < 20000 / share; round++) {
        static volatile uint8_t key;
        static struct value fresh;
        key = (uint8_t)random_below(KEYS);
        fresh = random_value();
        flash.operations = 0;
        flash.cut_at = 1 + random_below(40);
        flash.torn = TORN_BEFORE + (int)random_below(3);
        if (setjmp(dark) == 0)
            check(save(key, &fresh), "not saved", round);
        flash.cut_at = 0;
        memset(&work, 0, sizeof work);
        bool is_new = is_stored(key, &fresh);
        check(is_new || is_stored(key, &kept[key]), "neither old nor new", round);
        kept[key] = is_new ? fresh : kept[key];
        for (uint8_t other = 0; other < KEYS; other++)
            check(is_stored(other, &kept[other]), "another key has changed", round);
    }
}

/* Several values together: all old or all new, wherever the power goes. */
static void several_values_are_one(void) {
    static struct value kept[KEYS], fresh[KEYS];
    memset(&flash, 0xFF, sizeof flash.words);
    memset(kept, 0, sizeof kept);
    for (volatile unsigned round = 0; round < 5000 / share; round++) {
        struct hal_store_value values[KEYS];
        for (uint8_t key = 0; key < KEYS; key++) {
            fresh[key] = random_value();
            values[key] =
                (struct hal_store_value){.key = key, .bytes = fresh[key].bytes, .count = fresh[key].count};
        }
        flash.operations = 0;
        flash.cut_at = 1 + random_below(120);
        flash.torn = TORN_BEFORE + (int)random_below(3);
        if (setjmp(dark) == 0)
            check(save_values(values, KEYS), "not saved", round);
        flash.cut_at = 0;
        memset(&work, 0, sizeof work);
        bool is_new = is_stored(0, &fresh[0]);
        if (is_new)
            memcpy(kept, fresh, sizeof kept);
        for (uint8_t key = 0; key < KEYS; key++)
            check(is_stored(key, &kept[key]), "a mix of old and new", round);
    }
}

/* Whatever lies there: nothing is read beyond the pages (the sanitizers look), and a value can be saved. */
static void rubbish_is_no_value(void) {
    for (unsigned round = 0; round < 300 / share; round++) {
        struct value value = random_value();
        for (size_t i = 0; i < sizeof flash.words / 4; i++)
            flash.words[i] = random_below(4) == 0 ? 0x5EC00000u + random_below(8) : random_below(2000);
        check(flash_hal_store.load(&store, 1, value.bytes, sizeof value.bytes) <= 1, "a value of rubbish",
              round);
        check(save(1, &value) && is_stored(1, &value), "not saved over rubbish", round);
    }
}

/* Values, and older ones of the same keys before them. */
static void fill(struct value kept[KEYS], unsigned saves) {
    memset(&flash, 0xFF, sizeof flash.words);
    memset(kept, 0, KEYS * sizeof *kept);
    flash.cut_at = 0;
    for (unsigned i = 0; i < saves; i++) {
        uint8_t key = (uint8_t)(i < KEYS ? i : random_below(KEYS));
        kept[key] = random_value();
        check(save(key, &kept[key]), "not saved", i);
    }
}

/* One value is read as it was, or as what cannot be it: never an older one, never none. */
static bool is_silent_change(uint8_t key, const struct value *kept) {
    uint8_t bytes[LONGEST + 1];
    size_t count = flash_hal_store.load(&store, key, bytes, sizeof bytes);
    if (count == 1 && kept->count != 1)
        return false; /* lost, and said so */
    if (count != kept->count)
        return true;
    unsigned different = 0;
    for (size_t i = 0; i < count; i++)
        for (unsigned bit = 0; bit < 8; bit++)
            different += (bytes[i] ^ kept->bytes[i]) >> bit & 1;
    return different > 1; /* one bit of the value itself: the core's CRC sees it */
}

static void no_flipped_bit_brings_back_an_older_value(unsigned saves) {
    static struct value kept[KEYS];
    fill(kept, saves);
    for (size_t bit = 0; bit < 8 * sizeof flash.words / FLASH_PAGES * FLASH_LIVE_PAGES; bit += share) {
        if (flash.words[bit / 32] == UINT32_MAX && flash.words[bit / 32 ^ 1] == UINT32_MAX && bit % 997 != 0)
            continue; /* of the blank flash a part is enough */
        flash.words[bit / 32] ^= 1u << bit % 32;
        unsigned lost = 0;
        for (uint8_t key = 0; key < KEYS; key++) {
            check(!is_silent_change(key, &kept[key]), "silently another value", (unsigned)bit);
            lost += !is_stored(key, &kept[key]);
        }
        check(lost <= 1, "one bit, and several values are lost", (unsigned)bit);
        flash.words[bit / 32] ^= 1u << bit % 32;
    }
}

/* After a flip a value that is saved is there, and what was damaged is still said to be, also on the other
 * page. */
static void damage_is_not_forgotten_by_a_save(void) {
    static struct value kept[KEYS];
    fill(kept, 30);
    for (unsigned round = 0; round < 2000 / share; round++) {
        static uint32_t before[sizeof flash.words / 4];
        memcpy(before, flash.words, sizeof before);
        flash.words[random_below(sizeof flash.words / 4)] ^= 1u << random_below(32);
        struct value fresh = random_value();
        check(save(0, &fresh) && is_stored(0, &fresh), "not saved", round);
        for (uint8_t key = 1; key < KEYS; key++)
            check(!is_silent_change(key, &kept[key]), "silently another value after a save", round);
        memcpy(flash.words, before, sizeof before);
    }
}

static void the_copy_is_that_of_the_page_in_force(void) {
    static struct value kept[KEYS];
    enum { WORDS = FLASH_PAGE_SIZE / 4 };
    static uint32_t copy[WORDS];
    fill(kept, 8);
    flash.words[40] ^= 4;
    check(flash_hal_store.set_aside(&store) == HAL_STORE_BUSY && finish(), "no copy", 0);
    memcpy(copy, flash.words + FLASH_ASIDE * WORDS, FLASH_PAGE_SIZE);
    check(memcmp(flash.words, copy, FLASH_PAGE_SIZE) == 0, "another copy", 0);
    for (uint8_t key = 0; key < KEYS; key++)
        (void)save(key, &kept[key]);
    check(memcmp(copy, flash.words + FLASH_ASIDE * WORDS, FLASH_PAGE_SIZE) == 0, "the copy was written to",
          0);
}

static void a_value_that_is_too_long_is_refused(void) {
    static const uint8_t bytes[FLASH_PAGE_SIZE];
    const struct hal_store_value long_one = {.key = 1, .bytes = bytes, .count = FLASH_PAGE_SIZE / 4 + 1};
    const struct hal_store_value high = {.key = FLASH_KEYS, .bytes = bytes, .count = 4};
    check(!save_values(&long_one, 1), "too long, but saved", 0);
    check(!save_values(&high, 1), "a key too high, but saved", 0);
}

int main(int argc, char **argv) {
    if (argc == 2)
        share = (unsigned)atoi(argv[1]);
    if (share == 0)
        return 2;
    values_are_kept_however_many_there_were();
    a_power_cut_leaves_the_old_or_the_new_value();
    several_values_are_one();
    rubbish_is_no_value();
    no_flipped_bit_brings_back_an_older_value(6);
    no_flipped_bit_brings_back_an_older_value(60);
    damage_is_not_forgotten_by_a_save();
    the_copy_is_that_of_the_page_in_force();
    a_value_that_is_too_long_is_refused();
    check(flash.programmed_twice == 0, "units programmed twice", flash.programmed_twice);
    printf("%u failures\n", failures);
    return failures == 0 ? 0 : 1;
}
