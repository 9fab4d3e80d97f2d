/* SPDX-License-Identifier: MIT
 * Which signal is on which pin: the board's wiring (pin_config.h), moved by what the storage says. [start,
 * task] No register is touched here. */
#ifndef WIFICNC_ESP32_PIN_MAP_H
#define WIFICNC_ESP32_PIN_MAP_H

#include "pin_config.h"

#include <stdbool.h>
#include <stdint.h>

/** The pin of a signal. */
struct pin_wire {
    uint8_t gpio; /* NO_PIN: not wired */
    bool output;
    bool active_high; /* the level that switches on, or means triggered */
    uint8_t pull;     /* PIN_PULL_ of pin_config.h; inputs */
};

/** One wire for each signal: wire[SIGNAL_PROBE]; of a signal with an axis: wire[SIGNAL_STEP_X + axis]. */
struct pin_map {
    struct pin_wire wire[SIGNAL_COUNT];
};

/** What the storage holds, and where complaints go. */
struct pin_moves {
    /** @return false: nothing is stored under this key */
    bool (*read)(void *ctx, const char *key, uint8_t *gpio);
    void (*tell)(void *ctx, const char *text);
    void *ctx;
};

/** Board default wiring. */
void pin_map_init(struct pin_map *map);

/** Move signals to the pins that are stored (keys of protocol/nvs.toml; 255: unwired). A pin that cannot do
 * it, is not free on this board, or would serve two signals is refused: its signal stays where the board has
 * it, and tell() says so. @return how many were refused */
unsigned pin_map_move(struct pin_map *map, const struct pin_moves *moves);

/** Whether signals may be moved to this pin, by the chip's pin table and what this board needs by itself;
 * NO_PIN: always. */
bool pin_map_is_free(uint8_t gpio, bool output);

#endif
