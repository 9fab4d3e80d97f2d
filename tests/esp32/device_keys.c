/* SPDX-License-Identifier: MIT
 * Pins and network of the ESP32 in a made-up NVS whose power is cut at every write in turn. Pins: all old or
 * all new ones, and the next start wires what was stored. The network: until someone has come back the old
 * one returns, whatever a cut has left. */
#include "app/device_keys.h"
#include "check.h"
#include "pin_config.h"
#include "store/nvs_device.h"
#include "store/nvs_names.h"

#include <stdlib.h>
#include <string.h>

enum { ENTRIES = 64, NO_CUT = 1000, SIZE = 256, US_PER_S = 1000000 };

static struct entry {
    char key[16];
    uint8_t bytes[SIZE];
    size_t count; /* 0: free */
} entries[ENTRIES];
static int writes_left = NO_CUT;
static unsigned joined;

void network_join_stored(void) {
    joined++;
}

static struct entry *find(const char *key) {
    for (int i = 0; i < ENTRIES; i++)
        if (entries[i].count > 0 && strcmp(entries[i].key, key) == 0)
            return &entries[i];
    return NULL;
}

static bool put(const char *key, const void *bytes, size_t count) {
    struct entry *entry = find(key);
    if (writes_left-- <= 0 || count > SIZE || strlen(key) > 15)
        return false;
    for (int i = 0; entry == NULL && i < ENTRIES; i++)
        if (entries[i].count == 0)
            entry = &entries[i];
    if (entry == NULL)
        return false;
    strcpy(entry->key, key);
    memcpy(entry->bytes, bytes, count);
    entry->count = count;
    return true;
}

static size_t get_blob(void *ctx, const char *key, void *bytes, size_t size) {
    const struct entry *entry = find(key);
    (void)ctx;
    if (entry == NULL || entry->count > size)
        return 0;
    memcpy(bytes, entry->bytes, entry->count);
    return entry->count;
}
static bool set_blob(void *ctx, const char *key, const void *bytes, size_t count) {
    (void)ctx;
    return put(key, bytes, count);
}
static bool get(void *ctx, const char *key, enum nvs_type type, uint32_t *value) {
    (void)type;
    return get_blob(ctx, key, value, sizeof *value) == sizeof *value;
}
static bool set(void *ctx, const char *key, enum nvs_type type, uint32_t value) {
    (void)ctx, (void)type;
    return put(key, &value, sizeof value);
}
static size_t get_text(void *ctx, const char *key, char *text, size_t size) {
    return get_blob(ctx, key, text, size) > 0 ? strlen(text) : 0;
}
static bool set_text(void *ctx, const char *key, const char *text) {
    (void)ctx;
    return put(key, text, strlen(text) + 1);
}
static bool erase(void *ctx, const char *key) {
    struct entry *entry = find(key);
    (void)ctx;
    if (entry == NULL || writes_left-- <= 0)
        return false;
    entry->count = 0;
    return true;
}

static const struct nvs_ops ops = {.get = get,
                                   .set = set,
                                   .get_blob = get_blob,
                                   .set_blob = set_blob,
                                   .erase = erase,
                                   .get_text = get_text,
                                   .set_text = set_text};
static struct nvs_store store = {.ops = &ops};

/* ---- the start of the firmware, as far as this goes ---- */

static bool read_pin(void *ctx, const char *key, uint8_t *gpio) {
    uint32_t value;
    if (!get(ctx, key, NVS_U8, &value))
        return false;
    *gpio = (uint8_t)value;
    return true;
}
static void tell(void *ctx, const char *text) {
    (void)ctx;
    printf("%s\n", text);
    failures++;
}

static struct device *start(struct pin_map *map) {
    writes_left = NO_CUT;
    joined = 0;
    nvs_device_finish(&store);
    pin_map_init(map);
    CHECK(pin_map_move(map, &(struct pin_moves){.read = read_pin, .tell = tell}) == 0);
    return device_keys_create(map, &store);
}

static void forget(void) {
    memset(entries, 0, sizeof entries);
    writes_left = NO_CUT;
}

/* ---- tests ---- */

enum { STEP_X = 0x0500, STEP_Y, DIR_X = 0x0506, PROBE = 0x0513, ESTOP_INVERT = 0x0312, SSID = 0x0200 };

enum { ESTOP_HIGH = 1 }; /* as the board has it: a contact that opens */

static void swap_x_and_y(void) {
    struct pin_map map;
    struct device *device = start(&map);
    CHECK(device_set(device, STEP_X, PIN_STEP_Y) == DEVICE_DONE);
    CHECK(device_set(device, STEP_Y, PIN_STEP_X) == DEVICE_DONE);
    CHECK(device_save(device, 0) == DEVICE_DONE);
    free(device);
}

static bool are_swapped(void) {
    struct pin_map map;
    free(start(&map));
    const bool swapped = map.wire[SIGNAL_STEP_X].gpio == PIN_STEP_Y;
    CHECK(map.wire[SIGNAL_STEP_X].gpio == (swapped ? PIN_STEP_Y : PIN_STEP_X));
    CHECK(map.wire[SIGNAL_STEP_Y].gpio == (swapped ? PIN_STEP_X : PIN_STEP_Y));
    return swapped;
}

/* Whatever a power cut leaves: all old or all new pins, and old ones in the end. */
static void pins_that_no_one_confirms_return(void) {
    bool done = false;
    for (int cut = 0; !done && cut < 100; cut++) {
        forget();
        CHECK(!nvs_device_wiring_is_on_trial(&store));
        swap_x_and_y();
        CHECK(nvs_device_wiring_is_on_trial(&store) && are_swapped());
        writes_left = cut;
        done = nvs_device_end_wiring_trial(&store, false);
        const bool swapped = are_swapped();
        if (nvs_device_wiring_is_on_trial(&store))
            CHECK(nvs_device_end_wiring_trial(&store, false));
        else
            CHECK(!swapped);
        CHECK(!are_swapped() && !nvs_device_wiring_is_on_trial(&store));
    }
    CHECK(done);
}

static void pins_that_are_confirmed_stay(void) {
    struct pin_map map;
    forget();
    swap_x_and_y();
    CHECK(nvs_device_end_wiring_trial(&store, true));
    CHECK(are_swapped() && !nvs_device_wiring_is_on_trial(&store));
    CHECK(!nvs_device_end_wiring_trial(&store, false) && are_swapped()); /* it is over */
    forget(); /* two changes in a row: the first's old pins return */
    swap_x_and_y();
    struct device *device = start(&map);
    CHECK(device_set(device, STEP_X, PIN_STEP_X) == DEVICE_DONE);
    CHECK(device_set(device, STEP_Y, PIN_STEP_Y) == DEVICE_DONE);
    CHECK(device_set(device, ESTOP_INVERT, !ESTOP_HIGH) == DEVICE_DONE);
    CHECK(device_save(device, 0) == DEVICE_DONE);
    free(device);
    CHECK(nvs_device_end_wiring_trial(&store, false));
    free(start(&map));
    CHECK(map.wire[SIGNAL_ESTOP].active_high == ESTOP_HIGH && map.wire[SIGNAL_STEP_X].gpio == PIN_STEP_X);
}

static void pins_are_all_old_or_all_new(void) {
    bool stored = false;
    for (int cut = 0; !stored && cut < 100; cut++) {
        struct pin_map map;
        forget();
        struct device *device = start(&map);
        CHECK(device_set(device, STEP_X, PIN_STEP_Y) == DEVICE_DONE);
        CHECK(device_set(device, STEP_Y, PIN_STEP_X) == DEVICE_DONE);
        CHECK(device_set(device, ESTOP_INVERT, !ESTOP_HIGH) == DEVICE_DONE);
        writes_left = cut;
        stored = device_save(device, 0) == DEVICE_DONE;
        free(device);
        device = start(&map);
        const bool is_new = map.wire[SIGNAL_STEP_X].gpio == PIN_STEP_Y;
        CHECK(is_new || cut <= 1); /* what returns is written before what is to be */
        CHECK(map.wire[SIGNAL_STEP_X].gpio == (is_new ? PIN_STEP_Y : PIN_STEP_X));
        CHECK(map.wire[SIGNAL_STEP_Y].gpio == (is_new ? PIN_STEP_X : PIN_STEP_Y));
        CHECK(map.wire[SIGNAL_ESTOP].active_high == (is_new ? !ESTOP_HIGH : ESTOP_HIGH));
        uint32_t value;
        CHECK(device_get(device, STEP_X, &value) && value == map.wire[SIGNAL_STEP_X].gpio);
        CHECK(device_get(device, ESTOP_INVERT, &value) && value == map.wire[SIGNAL_ESTOP].active_high);
        free(device);
    }
    CHECK(stored);
}

static void what_cannot_be_is_refused(void) {
    struct pin_map map;
    forget();
    struct device *device = start(&map);
    CHECK(device_set(device, STEP_X, 19) == DEVICE_PIN); /* USB */
    CHECK(device_set(device, DIR_X, DEVICE_NO_PIN) == DEVICE_PIN);
    CHECK(device_set(device, PROBE, PIN_STEP_X) == DEVICE_DONE);
    CHECK(device_save(device, 0) == DEVICE_PIN && !device_differs(device));
    free(device);
}

static void set_network(struct device *device, const char *name) {
    char text[DEVICE_TEXT_SIZE] = {0};
    strcpy(text, name);
    CHECK(device_set_text(device, SSID, text) == DEVICE_DONE);
    CHECK(device_set(device, 0x0211, 0x1404A8C0) == DEVICE_DONE);
    CHECK(device_set(device, 0x0213, 0x00FFFFFF) == DEVICE_DONE);
    CHECK(device_set(device, 0x0210, 1) == DEVICE_DONE);
}

static bool is_at(const struct device *device, const char *name) {
    char text[DEVICE_TEXT_SIZE];
    uint32_t mode;
    CHECK(device_get_text(device, SSID, text) && device_get(device, 0x0210, &mode));
    return strcmp(text, name) == 0 && mode == (strcmp(name, "new") == 0);
}

/* Stored with "old" and trusted; then "new", with the power cut at write n. */
static void the_old_network_returns_after_any_cut(void) {
    bool stored = false;
    for (int cut = 0; !stored && cut < 100; cut++) {
        struct pin_map map;
        forget();
        (void)set_text(NULL, NVS_WIFI_SSID, "old");
        struct device *device = start(&map);
        CHECK(!device->on_trial);
        set_network(device, "new");
        writes_left = cut;
        stored = device_save(device, 0) == DEVICE_DONE;
        free(device);
        device = start(&map);
        CHECK(device->on_trial == (cut > 0));
        device_poll(device, (uint64_t)(DEVICE_TRIAL_S + 1) * US_PER_S, true);
        CHECK(is_at(device, "old") && joined == (cut > 0));
        free(device);
        device = start(&map);
        CHECK(is_at(device, "old") && !device->on_trial);
        free(device);
    }
    CHECK(stored);
}

static void who_comes_back_keeps_it(void) {
    struct pin_map map;
    forget();
    (void)set_text(NULL, NVS_WIFI_SSID, "old");
    struct device *device = start(&map);
    set_network(device, "new");
    CHECK(device_save(device, 0) == DEVICE_DONE && joined == 0);
    device_poll(device, 2 * US_PER_S, false);
    CHECK(joined == 0); /* not while something moves */
    device_poll(device, 2 * US_PER_S, true);
    CHECK(joined == 1);
    device_connected(device, 3);
    device_contact(device, 3);
    device_poll(device, (uint64_t)1000 * US_PER_S, true);
    CHECK(joined == 1 && is_at(device, "new"));
    free(device);
    device = start(&map);
    CHECK(is_at(device, "new") && !device->on_trial);
    free(device);
}

int main(void) {
    pins_are_all_old_or_all_new();
    pins_that_no_one_confirms_return();
    pins_that_are_confirmed_stay();
    what_cannot_be_is_refused();
    the_old_network_returns_after_any_cut();
    who_comes_back_keeps_it();
    return report();
}
