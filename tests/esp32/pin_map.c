/* SPDX-License-Identifier: MIT
 * Signals moved to other pins by the storage, on the ESP32-S3-DevKitC with octal memory. */
#include "io/pin_map.h"
#include "check.h"
#include "pin_config.h"
#include "step_pins.h"

#include <string.h>

static struct stored {
    const char *key;
    uint8_t gpio;
} stored[8];
static char told[2048];

static bool read_stored(void *ctx, const char *key, uint8_t *gpio) {
    (void)ctx;
    for (size_t i = 0; i < sizeof stored / sizeof stored[0] && stored[i].key != NULL; i++)
        if (strcmp(stored[i].key, key) == 0) {
            *gpio = stored[i].gpio;
            return true;
        }
    return false;
}

static void tell(void *ctx, const char *text) {
    (void)ctx;
    strcat(strcat(told, text), "\n");
}

static unsigned move(struct pin_map *map) {
    told[0] = '\0';
    pin_map_init(map);
    return pin_map_move(map, &(struct pin_moves){.read = read_stored, .tell = tell});
}

static uint8_t pin_of(const struct pin_map *map, enum board_signal signal) {
    return map->wire[signal].gpio;
}

static bool no_pin_serves_two(const struct pin_map *map) {
    for (size_t i = 0; i < SIGNAL_COUNT; i++)
        for (size_t k = 0; k < i; k++)
            if (map->wire[i].gpio != NO_PIN && map->wire[i].gpio == map->wire[k].gpio)
                return false;
    return true;
}

#define STORE(...)                                                                                           \
    memset(stored, 0, sizeof stored);                                                                        \
    memcpy(stored, (struct stored[]){__VA_ARGS__}, sizeof (struct stored[]){__VA_ARGS__})

static void without_anything_stored_it_is_the_boards_wiring(void) {
    struct pin_map map;
    STORE({NULL, 0});
    CHECK(move(&map) == 0 && told[0] == '\0');
    CHECK(pin_of(&map, SIGNAL_STEP_X) == PIN_STEP_X && pin_of(&map, SIGNAL_ENABLE) == PIN_ENABLE);
    CHECK(!map.wire[SIGNAL_ENABLE].active_high && map.wire[SIGNAL_PROBE].pull == PIN_PULL_UP);
    CHECK(pin_of(&map, SIGNAL_LIMIT_B) == NO_PIN);
}

static void signals_move_exchange_and_go(void) {
    struct pin_map map;
    STORE({"p_sx", PIN_STEP_Y}, {"p_sy", PIN_STEP_X}, {"p_prb", NO_PIN}, {"p_cp", PIN_PROBE});
    CHECK(move(&map) == 0 && told[0] == '\0');
    CHECK(pin_of(&map, SIGNAL_STEP_X) == PIN_STEP_Y && pin_of(&map, SIGNAL_STEP_Y) == PIN_STEP_X);
    CHECK(pin_of(&map, SIGNAL_PROBE) == NO_PIN && pin_of(&map, SIGNAL_CHARGE_PUMP) == PIN_PROBE);
    CHECK(map.wire[SIGNAL_CHARGE_PUMP].output && no_pin_serves_two(&map));
}

/* Flash, PSRAM, USB, a strapping pin, the W5500, no pin at all. */
static void pins_that_cannot_are_refused_and_named(void) {
    static const uint8_t bad[] = {30, 35, 19, 45, 46, 22, 60};
    for (size_t i = 0; i < sizeof bad; i++) {
        struct pin_map map;
        STORE({"p_dz", bad[i]});
        CHECK(move(&map) == 1 && pin_of(&map, SIGNAL_DIR_Z) == PIN_DIR_Z);
        CHECK(strstr(told, "p_dz") != NULL && strstr(told, "dir_z") != NULL);
    }
}

/* X goes back home, where Y has gone; so Y goes back, where Z has gone; and so on. */
static void clashes_are_solved_to_the_end(void) {
    struct pin_map map;
    STORE({"p_sx", PIN_PROBE}, {"p_sy", PIN_STEP_X}, {"p_sz", PIN_STEP_Y}, {"p_sa", PIN_STEP_Z});
    CHECK(move(&map) >= 1 && no_pin_serves_two(&map));
    CHECK(pin_of(&map, SIGNAL_PROBE) == PIN_PROBE && pin_of(&map, SIGNAL_STEP_X) != NO_PIN);
    CHECK(strstr(told, "p_sx") != NULL);
}

int main(void) {
    without_anything_stored_it_is_the_boards_wiring();
    signals_move_exchange_and_go();
    pins_that_cannot_are_refused_and_named();
    clashes_are_solved_to_the_end();
    return report();
}
