/* SPDX-License-Identifier: MIT */
#include "io/pin_map.h"

#include "step_pins.h"
#include "store/nvs_names.h"

#include <stdio.h>
#include <string.h>

_Static_assert((int)SIGNAL_DIR_X == (int)SIGNAL_STEP_X + 6,
               "the signals of an axis that it needs are neighbours");
_Static_assert((unsigned)NO_PIN == (unsigned)PIN_NONE, "no pin is the same number in both");

/* A signal that can be moved. */
struct row {
    const char *key, *name;
    enum board_signal signal;
    uint8_t board; /* the board's own pin */
    bool output;
};

#define MOVABLE(key, signal, name, pin, output) {key, name, signal, (uint8_t)(pin), output},
static const struct row rows[] = {NVS_PINS(MOVABLE)};
enum { ROWS = sizeof rows / sizeof rows[0] };

struct wired {
    enum board_signal signal;
    struct pin_wire wire;
};

#define OUTPUT_WIRE(pin, signal, level)      {signal, {(uint8_t)(pin), true, level, PIN_PULL_NONE}},
#define INPUT_WIRE(pin, signal, level, pull) {signal, {(uint8_t)(pin), false, level, pull}},
static const struct wired wired[] = {BOARD_OUTPUTS(OUTPUT_WIRE) BOARD_INPUTS(INPUT_WIRE)};

/* A signal that can be moved but that this board does not wire has the usual levels. */
void pin_map_init(struct pin_map *map) {
    for (unsigned signal = 0; signal < SIGNAL_COUNT; signal++)
        map->wire[signal] = (struct pin_wire){.gpio = NO_PIN};
    for (size_t i = 0; i < ROWS; i++)
        map->wire[rows[i].signal] = (struct pin_wire){.gpio = NO_PIN,
                                                      .output = rows[i].output,
                                                      .active_high = rows[i].output,
                                                      .pull = rows[i].output ? PIN_PULL_NONE : PIN_PULL_UP};
    for (size_t i = 0; i < sizeof wired / sizeof wired[0]; i++)
        map->wire[wired[i].signal] = wired[i].wire;
}

/* What the rules of boards allow; a signal of no key can go nowhere. */
static bool may_be(const struct row *row, uint8_t gpio) {
    static const struct {
        uint64_t legal;
        uint8_t signal;
    } keys[] = {
#define KEY(pin, signal, legal) {legal, signal},
        BOARD_PIN_KEYS(KEY)};
    const bool needed = row->signal >= SIGNAL_STEP_X && row->signal <= SIGNAL_DIR_C;
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++)
        if (keys[i].signal == row->signal && keys[i].legal != 0)
            return gpio == NO_PIN ? !needed : gpio < 64 && (keys[i].legal >> gpio & 1) != 0;
    return false;
}

bool pin_map_is_free(uint8_t gpio, bool output) {
    static const uint8_t outputs[] = BOARD_FREE_OUTPUT_PINS, inputs[] = BOARD_FREE_INPUT_PINS;
    const uint8_t *pins = output ? outputs : inputs;
    size_t count = output ? sizeof outputs : sizeof inputs;
    return gpio == NO_PIN || memchr(pins, gpio, count) != NULL;
}

/* Another signal with the same pin. */
static const struct pin_wire *rival(const struct pin_map *map, const struct pin_wire *wire) {
    for (unsigned signal = 0; signal < SIGNAL_COUNT; signal++)
        if (map->wire[signal].gpio == wire->gpio && &map->wire[signal] != wire && wire->gpio != NO_PIN)
            return &map->wire[signal];
    return NULL;
}

/* A signal is never left without its pin: a limit switch that is silently not there would be worse than
 * one on the board's own pin. */
static void refuse(struct pin_wire *wire, const struct row *row, const struct pin_moves *moves,
                   const char *why) {
    char text[112];
    snprintf(text, sizeof text, "%s: GPIO%u cannot be %s: %s. The board's own pin is used", row->key,
             (unsigned)wire->gpio, row->name, why);
    moves->tell(moves->ctx, text);
    wire->gpio = row->board;
}

/* One move back takes its old pin from others that were moved there, so look again until all agree. The
 * board's own map has no clash, so this ends. */
static unsigned settle(struct pin_map *map, const struct pin_moves *moves) {
    unsigned refused = 0;
    for (size_t i = 0; i < ROWS; i++) {
        struct pin_wire *wire = &map->wire[rows[i].signal];
        if (wire->gpio != rows[i].board && rival(map, wire) != NULL) {
            refuse(wire, &rows[i], moves, "another signal uses it");
            refused++;
            i = (size_t)-1;
        }
    }
    return refused;
}

unsigned pin_map_move(struct pin_map *map, const struct pin_moves *moves) {
    unsigned refused = 0;
    for (size_t i = 0; i < ROWS; i++) {
        struct pin_wire *wire = &map->wire[rows[i].signal];
        uint8_t gpio;
        if (!moves->read(moves->ctx, rows[i].key, &gpio) || gpio == wire->gpio)
            continue;
        wire->gpio = gpio;
        if (!may_be(&rows[i], gpio)) {
            refuse(wire, &rows[i], moves, "the board uses it otherwise, or the pin does not support it");
            refused++;
        }
    }
    uint8_t sense;
    if (moves->read(moves->ctx, NVS_ESTOP_INVERT, &sense) && sense <= 1)
        map->wire[SIGNAL_ESTOP].active_high = sense != 0;
    return refused + settle(map, moves);
}
