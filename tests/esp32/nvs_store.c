/* SPDX-License-Identifier: MIT
 * The ESP32's store over a made-up NVS whose power is cut at every write in turn: all old or all new values.
 */
#include "store/nvs_store.h"
#include "settings/store.h"
#include "store/nvs_channels.h"

#include <stdio.h>
#include <string.h>

enum { ENTRIES = SETTINGS_COUNT + 16, BLOB_MAX = STORE_BATCH_SIZE + 64, NO_CUT = 1000 };

struct entry {
    char key[16];
    int type; /* enum nvs_type, or -1: a blob; -2: free */
    uint32_t value;
    uint8_t blob[BLOB_MAX];
    size_t size;
};

static struct entry entries[ENTRIES];
static int writes_left;
static bool cut_loses_blobs; /* that are written a second time */
static unsigned failures;
static struct store_lost lost;

static struct entry *entry_of(const char *key) {
    for (int i = 0; i < ENTRIES; i++)
        if (entries[i].type != -2 && strcmp(entries[i].key, key) == 0)
            return &entries[i];
    return NULL;
}

static struct entry *make_entry(const char *key) {
    struct entry *entry = entry_of(key);
    for (int i = 0; entry == NULL && i < ENTRIES; i++)
        if (entries[i].type == -2)
            entry = &entries[i];
    if (entry == NULL || strlen(key) >= sizeof entry->key)
        return NULL;
    strcpy(entry->key, key);
    return entry;
}

static bool power_is_on(void) {
    return writes_left-- > 0;
}

static bool get(void *ctx, const char *key, enum nvs_type type, uint32_t *value) {
    const struct entry *entry = entry_of(key);
    (void)ctx;
    if (entry == NULL || entry->type != (int)type)
        return false;
    *value = entry->value;
    return true;
}

static bool set(void *ctx, const char *key, enum nvs_type type, uint32_t value) {
    (void)ctx;
    struct entry *entry = power_is_on() ? make_entry(key) : NULL;
    if (entry == NULL)
        return false;
    entry->type = (int)type;
    entry->value = value;
    return true;
}

static size_t get_blob(void *ctx, const char *key, void *bytes, size_t size) {
    const struct entry *entry = entry_of(key);
    (void)ctx;
    if (entry == NULL || entry->type != -1 || entry->size > size)
        return 0;
    memcpy(bytes, entry->blob, entry->size);
    return entry->size;
}

/* NVS of ESP-IDF 5.5 loses a blob when the power goes after its new data are written and before its new index
 * is: Page::mLoadEntryTable() takes the old data for a duplicate of the new ones, and then neither has an
 * index that fits. */
static bool set_blob(void *ctx, const char *key, const void *bytes, size_t count) {
    (void)ctx;
    struct entry *old = entry_of(key);
    struct entry *entry = power_is_on() && count <= BLOB_MAX ? make_entry(key) : NULL;
    if (entry == NULL && old != NULL && cut_loses_blobs && writes_left == -1)
        old->type = -2;
    if (entry == NULL)
        return false;
    entry->type = -1;
    entry->size = count;
    memcpy(entry->blob, bytes, count);
    return true;
}

static bool erase(void *ctx, const char *key) {
    struct entry *entry = entry_of(key);
    (void)ctx;
    if (entry == NULL || !power_is_on())
        return false;
    entry->type = -2;
    return true;
}

static const struct nvs_ops ops = {
    .get = get, .set = set, .get_blob = get_blob, .set_blob = set_blob, .erase = erase};
static const struct nvs_store nvs = {.ops = &ops};
static const struct store store = {.ops = &nvs_hal_store, .ctx = &nvs};

static void check(bool good, const char *what, int cut) {
    if (!good && ++failures <= 10)
        printf("cut %d: %s\n", cut, what);
}

static void start_empty(void) {
    for (int i = 0; i < ENTRIES; i++)
        entries[i].type = -2;
    writes_left = NO_CUT;
}

static struct settings changed(unsigned how_many) {
    struct settings settings;
    settings_defaults(&settings);
    for (uint16_t i = 0; i < how_many; i++)
        (void)settings_set(&settings, (uint16_t)(100 + i), 80.125 + i, 6);
    return settings;
}

static bool same(const struct settings *a, const struct settings *b) {
    uint16_t number = SETTINGS_BEGIN;
    while (settings_next(&number, 6)) {
        double x, y;
        uint8_t decimals;
        (void)settings_get(a, number, 6, &x, &decimals);
        (void)settings_get(b, number, 6, &y, &decimals);
        if (x != y)
            return false;
    }
    return true;
}

static struct settings kept(int cut) {
    struct settings settings;
    settings_defaults(&settings);
    enum store_result result = store_load_settings(&store, &settings, 6, &lost);
    check(result != STORE_DAMAGED, "damaged", cut);
    return settings;
}

/* @return false: the save went through, no cut came */
static bool cut_at(int cut, unsigned how_many) {
    struct settings before = changed(0), after = changed(how_many);
    start_empty();
    (void)store_save_settings(&store, &before);
    writes_left = cut;
    bool saved = store_save_settings(&store, &after);
    writes_left = NO_CUT;
    struct settings found = kept(cut);
    check(same(&found, &after) || (!saved && same(&found, &before)), "a mix of old and new", cut);
    found = kept(cut);
    check(same(&found, &after) || (!saved && same(&found, &before)), "a mix at the second start", cut);
    check(entry_of("journal") == NULL, "the job is not finished", cut);
    return !saved;
}

/* Settings and other values in one step, as $RST=* stores them. @return false: it went through, no cut came
 */
static bool cut_batch_at(int cut) {
    struct settings before = changed(0), after = changed(4);
    uint8_t bytes[2][200], read[200];
    struct store_batch batch = {.count = 0};
    start_empty();
    (void)store_save_settings(&store, &before);
    for (uint8_t which = 0; which < 2; which++)
        memset(bytes[which], 5 + which, sizeof bytes[which]);
    for (uint8_t key = 2; key <= 6; key++)
        (void)store_save(&store, key, STORE_VERSION, bytes[0], sizeof bytes[0]);
    store_add_settings(&batch, &store, &after);
    for (uint8_t key = 2; key <= 6; key++)
        store_add(&batch, &store, key, STORE_VERSION, bytes[1], sizeof bytes[1]);
    writes_left = cut;
    bool saved = store_write(&store, &batch) == HAL_STORE_DONE;
    writes_left = NO_CUT;
    for (int start = 0; start < 2; start++) {
        struct settings found = kept(cut);
        bool is_new = same(&found, &after);
        check(is_new || (!saved && same(&found, &before)), "a mix within the settings", cut);
        for (uint8_t key = 2; key <= 6; key++)
            check(store_load(&store, key, STORE_VERSION, read, sizeof read) == STORE_FOUND &&
                      memcmp(read, bytes[is_new], sizeof read) == 0,
                  "a mix of old and new values", cut);
    }
    check(entry_of("journal") == NULL, "the job is not finished", cut);
    return !saved;
}

/* One value, as a startup line or an offset. @return false: it went through, no cut came */
static bool cut_value_at(int cut) {
    const uint8_t old[] = {1, 2, 3}, fresh[] = {4, 5, 6};
    uint8_t read[sizeof old];
    start_empty();
    (void)store_save(&store, 3, STORE_VERSION, old, sizeof old);
    writes_left = cut;
    const bool saved = store_save(&store, 3, STORE_VERSION, fresh, sizeof fresh);
    writes_left = NO_CUT;
    for (int start = 0; start < 2; start++)
        check(store_load(&store, 3, STORE_VERSION, read, sizeof read) == STORE_FOUND &&
                  (memcmp(read, fresh, sizeof read) == 0 || (!saved && memcmp(read, old, sizeof read) == 0)),
              "neither the old nor the new value", cut);
    check(entry_of("journal") == NULL, "the job is not finished", cut);
    return !saved;
}

/* ---- the channels of an I/O module ---- */

static struct channels changed_channels(unsigned how_many) {
    struct channels channels;
    channels_init(&channels, NULL, NULL);
    for (unsigned n = 0; n < how_many; n++)
        (void)channels_set_value(&channels, CHANNELS_IO_PIN_0 + n, 10 + n);
    return channels;
}

static bool same_channels(const struct channels *a, const struct channels *b) {
    return memcmp(&a->config, &b->config, sizeof a->config) == 0;
}

/* @return false: it was kept, no cut came */
static bool cut_channels_at(int cut, unsigned how_many) {
    struct channels before = changed_channels(0), after = changed_channels(how_many);
    start_empty();
    (void)nvs_channels_keep(&nvs, &before.config);
    writes_left = cut;
    bool kept = nvs_channels_keep(&nvs, &after.config);
    writes_left = NO_CUT;
    for (int start = 0; start < 2; start++) {
        struct channels found = changed_channels(0);
        nvs_channels_load(&nvs, &found);
        check(same_channels(&found, &after) || (!kept && same_channels(&found, &before)),
              "a mix of old and new channels", cut);
    }
    check(entry_of("io_pending") == NULL, "the job is not finished", cut);
    return !kept;
}

static void a_stored_channel_out_of_range_is_left_out(void) {
    struct channels channels = changed_channels(0);
    start_empty();
    (void)set(NULL, "io_count", NVS_U8, 17);
    (void)set(NULL, "io_dir", NVS_U16, 0xFF00);
    nvs_channels_load(&nvs, &channels);
    check(channels.config.value[CHANNELS_IO_COUNT] == 0, "taken", -1);
    check(channels.config.value[CHANNELS_IO_DIRECTION] == 0xFF00, "not taken", -1);
}

static void what_is_not_stored_stays_as_the_board_brings_it(void) {
    struct settings settings = changed(0);
    start_empty();
    settings.step_pulse_us = 2;
    (void)set(NULL, "spm_x", NVS_FLOAT, 0x42A00000); /* 80.0 */
    (void)store_load_settings(&store, &settings, 6, &lost);
    check(settings.steps_per_mm[0] == 80.0f && settings.step_pulse_us == 2, "not only what is stored", -1);
}

static void a_value_out_of_range_is_damage(void) {
    struct settings settings = changed(0), before = settings;
    start_empty();
    (void)set(NULL, "spm_x", NVS_FLOAT, 0xC2A00000); /* -80.0 */
    check(store_load_settings(&store, &settings, 6, &lost) == STORE_DAMAGED && same(&settings, &before),
          "taken", -1);
}

/* NVS drops an entry whose check fails. Whichever it is, its value is reported to be lost, and the others
 * stay.
 */
static void a_setting_that_nvs_has_dropped_is_damage(void) {
    struct settings all = changed(6);
    start_empty();
    check(store_save_settings(&store, &all), "not saved", -1);
    for (unsigned i = 0; i < SETTINGS_COUNT; i++) {
        struct settings found = changed(0);
        struct entry *entry = entry_of(nvs_keys[i].key);
        int type = entry->type;
        entry->type = -2;
        check(store_load_settings(&store, &found, 6, &lost) == STORE_DAMAGED && lost.count >= 1,
              "a lost setting is not noticed", (int)i);
        check(lost.number[0] == nvs_keys[i].number || nvs_keys[i].number == 22, "another is said to be lost",
              (int)i);
        entry->type = type;
        found = changed(0);
        check(store_load_settings(&store, &found, 6, &lost) == STORE_FOUND && same(&found, &all),
              "not as saved", (int)i);
    }
}

/* Firmware that knew no number above 255 listed fewer. */
static void a_shorter_list_counts(void) {
    struct settings all = changed(6), found = changed(0);
    start_empty();
    check(store_save_settings(&store, &all), "not saved", -1);
    entry_of("stored")->size = 2 + 256 / 8;
    entry_of("spm_x")->type = entry_of("spin_on")->type = -2;
    check(store_load_settings(&store, &found, 6, &lost) == STORE_DAMAGED && lost.count == 1 &&
              lost.number[0] == 100,
          "not what the list has", -1);
}

static void a_value_that_nvs_has_dropped_is_damage(void) {
    const uint8_t bytes[] = {1, 2, 3};
    uint8_t read[sizeof bytes];
    for (uint8_t key = 2; key <= 6; key++) {
        start_empty();
        check(store_save(&store, key, STORE_VERSION, bytes, sizeof bytes), "not saved", key);
        entry_of((char[]){'k', 'e', 'p', 't', '0', '0', (char)('0' + key), '\0'})->type = -2;
        check(store_load(&store, key, STORE_VERSION, read, sizeof read) == STORE_DAMAGED, "not noticed", key);
        check(store_save(&store, key, STORE_VERSION, bytes, sizeof bytes), "not saved again", key);
        check(store_load(&store, key, STORE_VERSION, read, sizeof read) == STORE_FOUND, "not made good", key);
    }
}

/* A firmware with one more setting finds it missing, and it was never stored. */
static void a_list_that_is_lost_is_no_damage(void) {
    struct settings all = changed(6), found = changed(0);
    start_empty();
    check(store_save_settings(&store, &all), "not saved", -1);
    entry_of("stored")->type = -2;
    check(store_load_settings(&store, &found, 6, &lost) == STORE_FOUND && same(&found, &all), "not as saved",
          -1);
    check(nvs_hal_store.set_aside(&nvs) == HAL_STORE_DONE && entry_of("aside") != NULL, "no copy", -1);
}

static void what_is_stored_is_not_written_again(void) {
    struct settings all = changed(6);
    const uint8_t bytes[] = {1, 2, 3};
    start_empty();
    check(store_save_settings(&store, &all) && store_save(&store, 2, STORE_VERSION, bytes, sizeof bytes),
          "not saved", -1);
    writes_left = 0;
    check(store_save_settings(&store, &all) && store_save(&store, 2, STORE_VERSION, bytes, sizeof bytes),
          "written again", -1);
}

static void other_values_are_blobs(void) {
    const char text[] = "G21";
    char read[sizeof text];
    start_empty();
    check(store_save(&store, 3, STORE_VERSION, text, sizeof text), "not saved", -1);
    check(store_load(&store, 3, STORE_VERSION, read, sizeof read) == STORE_FOUND && strcmp(read, text) == 0,
          "not found", -1);
    check(store_load(&store, 4, STORE_VERSION, read, sizeof read) == STORE_EMPTY, "found", -1);
}

static void cut_everywhere(void) {
    int writes = 0;
    while (cut_batch_at(writes))
        writes++;
    check(writes == 4 + 5 + 2, "not that many writes for a batch", writes);
    for (writes = 0; cut_value_at(writes); writes++)
        continue;
    check(writes == 3, "not that many writes for a value", writes);
}

int main(void) {
    for (unsigned how_many = 1; how_many <= 6; how_many++) {
        int cut = 0;
        while (cut_at(cut, how_many))
            cut++;
        check(cut == (how_many == 1 ? 1 : (int)how_many + 2), "not that many writes", cut);
    }
    cut_everywhere();
    cut_loses_blobs = true;
    cut_everywhere();
    for (unsigned how_many = 1; how_many <= 6; how_many++)
        for (int cut = 0; cut_at(cut, how_many); cut++)
            continue;
    for (unsigned how_many = 1; how_many <= 3; how_many++) {
        int cut = 0;
        while (cut_channels_at(cut, how_many))
            cut++;
        check(cut == (how_many == 1 ? 1 : (int)how_many + 2), "not that many writes for channels", cut);
    }
    a_stored_channel_out_of_range_is_left_out();
    what_is_not_stored_stays_as_the_board_brings_it();
    a_value_out_of_range_is_damage();
    other_values_are_blobs();
    a_setting_that_nvs_has_dropped_is_damage();
    a_shorter_list_counts();
    a_value_that_nvs_has_dropped_is_damage();
    a_list_that_is_lost_is_no_damage();
    what_is_stored_is_not_written_again();
    printf("%u failures\n", failures);
    return failures == 0 ? 0 : 1;
}
