/* SPDX-License-Identifier: MIT
 * A store as the firmware fills it: of all its bits none changes a value of the user in silence. */
#include "settings/store.h"
#include "store/flash_store.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { KEYS_FROM = 2, KEYS_END = 7, WORDS = FLASH_LIVE_PAGES * FLASH_PAGE_SIZE / 4, BLANK_STEP = 61 };

static uint32_t words[FLASH_PAGES * FLASH_PAGE_SIZE / 4];
static unsigned failures;

static void check(bool good, const char *what, unsigned number) {
    if (!good && failures++ < 20)
        printf("%s (%u)\n", what, number);
}

static void erase(void *ctx, unsigned page) {
    (void)ctx;
    memset(words + page * FLASH_PAGE_SIZE / 4, 0xFF, FLASH_PAGE_SIZE);
}

static void program(void *ctx, unsigned page, unsigned unit, const uint32_t from[FLASH_UNIT_WORDS]) {
    (void)ctx;
    memcpy(words + (page * FLASH_UNITS + unit) * FLASH_UNIT_WORDS, from, FLASH_UNIT_SIZE);
}

static enum hal_store_state state(void *ctx) {
    (void)ctx;
    return HAL_STORE_DONE;
}

static struct flash_work work;
static const struct flash_ops ops = {.words = words, .erase = erase, .program = program, .state = state};
static const struct flash_store flash = {.ops = &ops, .work = &work};
static const struct store store = {.ops = &flash_hal_store, .ctx = &flash};

/* Sizes of the machine's values: offsets, start-up lines, $I, more offsets, tools. */
static const size_t sizes[KEYS_END] = {0, 0, 384, 160, 80, 144, 384};

struct all {
    struct settings settings;
    uint8_t value[KEYS_END][STORE_SIZE_MAX];
};
static struct all truth;

static void save(const struct store_batch *batch) {
    enum hal_store_state saved = store_write(&store, batch);
    while (flash_store_poll(&flash)) {
    }
    check(saved != HAL_STORE_FAILED && store_state(&store) == HAL_STORE_DONE, "not saved", 0);
}

static void save_settings(uint16_t number, double value) {
    static struct store_batch batch;
    batch.count = batch.used = 0;
    check(settings_set(&truth.settings, number, value, 6) == STATUS_OK, "not set", number);
    store_add_settings(&batch, &store, &truth.settings);
    save(&batch);
}

static void save_value(uint8_t key, uint8_t seed) {
    static struct store_batch batch;
    batch.count = batch.used = 0;
    for (size_t i = 0; i < sizes[key]; i++)
        truth.value[key][i] = (uint8_t)(seed * 31 + i * 7 + key);
    store_add(&batch, &store, key, STORE_VERSION, truth.value[key], sizes[key]);
    save(&batch);
}

/* Older values of every key before the newest, on both pages. */
static void fill(unsigned rounds) {
    memset(words, 0xFF, sizeof words);
    memset(&work, 0, sizeof work);
    settings_defaults(&truth.settings);
    save_settings(100, 77);
    for (unsigned round = 0; round < rounds; round++) {
        save_settings((uint16_t)(100 + round % 6), 100 + round);
        save_value((uint8_t)(KEYS_FROM + round % (KEYS_END - KEYS_FROM)), (uint8_t)round);
    }
    save_settings(100, 640);
}

static bool same_setting(const struct settings *found, uint16_t number) {
    double a, b;
    uint8_t decimals;
    (void)settings_get(found, number, 6, &a, &decimals);
    (void)settings_get(&truth.settings, number, 6, &b, &decimals);
    return a == b;
}

static bool is_named(const struct store_lost *lost, uint16_t number) {
    for (unsigned i = 0; i < lost->count && i < STORE_LOST_MAX; i++)
        if (lost->number[i] == number)
            return true;
    return lost->count > STORE_LOST_MAX;
}

/* A setting is as it was, or the store says that it is not. @return true: damage was reported */
static bool check_settings(unsigned bit) {
    struct settings found;
    struct store_lost lost;
    settings_defaults(&found);
    bool damaged = store_load_settings(&store, &found, 6, &lost) == STORE_DAMAGED;
    uint16_t number = SETTINGS_BEGIN;
    while (settings_next(&number, 6))
        check(same_setting(&found, number) || (damaged && (is_named(&lost, number) || lost.count > 0)),
              "a setting has changed silently", bit);
    return damaged;
}

static bool check_value(uint8_t key, unsigned bit) {
    uint8_t found[STORE_SIZE_MAX];
    enum store_result result = store_load(&store, key, STORE_VERSION, found, sizes[key]);
    bool same = result == STORE_FOUND && memcmp(found, truth.value[key], sizes[key]) == 0;
    check(same || result == STORE_DAMAGED, "a value has changed silently", bit);
    return result == STORE_DAMAGED;
}

/* Of blank flash a part is enough: every bit of it is like the others. */
static bool is_looked_at(size_t bit) {
    size_t unit = bit / 32 / FLASH_UNIT_WORDS * FLASH_UNIT_WORDS;
    for (unsigned word = 0; word < FLASH_UNIT_WORDS; word++)
        if (words[unit + word] != UINT32_MAX)
            return true;
    return bit % BLANK_STEP == 0;
}

/* @param step  every so manyth; 1: all of them */
static void flip_bits(unsigned rounds, size_t step) {
    unsigned looked = 0, damaged = 0;
    fill(rounds);
    for (size_t bit = 0; bit < 32 * (size_t)WORDS; bit += step) {
        if (!is_looked_at(bit))
            continue;
        words[bit / 32] ^= 1u << bit % 32;
        unsigned values = check_settings((unsigned)bit);
        for (uint8_t key = KEYS_FROM; key < KEYS_END; key++)
            values += check_value(key, (unsigned)bit);
        check(values <= 1, "one bit, and several values are lost", (unsigned)bit);
        words[bit / 32] ^= 1u << bit % 32;
        looked++;
        damaged += values;
    }
    printf("%u rounds: %u bits, %u of them damage\n", rounds, looked, damaged);
    check(looked > 8000 && damaged > 1000 && damaged < looked, "not what was meant", damaged);
}

int main(int count, char **arguments) {
    (void)arguments;
    bool all = count > 1;
    flip_bits(5, 1);             /* the first page, little of it */
    flip_bits(16, all ? 1 : 7);  /* nearly full */
    flip_bits(40, all ? 1 : 11); /* both pages, one of them past */
    printf("%u failures\n", failures);
    return failures == 0 ? 0 : 1;
}
