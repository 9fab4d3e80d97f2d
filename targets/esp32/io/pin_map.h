/* SPDX-License-Identifier: MIT
 * Which signal is on which pin: the board's wiring (pin_config.h), moved by what the storage says. [start,
 * task] No register is touched here. */
#ifndef WIFICNC_ESP32_PIN_MAP_H
#define WIFICNC_ESP32_PIN_MAP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** A signal and its pin. */
struct pin_wire {
    const char *signal; /* as in boards/: "step_x" */
    uint8_t gpio;       /* GPIO_NONE: not wired */
    bool output;
    bool active_high; /* the level that switches on, or means triggered */
    uint8_t pull;     /* PIN_PULL_ of pin_config.h; inputs */
};

enum { PIN_MAP_SIZE = 56 };

struct pin_map {
    struct pin_wire wire[PIN_MAP_SIZE];
    size_t count;
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
 * GPIO_NONE: always. */
bool pin_map_is_free(uint8_t gpio, bool output);

/** @return the signal's wire; one with GPIO_NONE for a signal that is not wired */
const struct pin_wire *pin_map_find(const struct pin_map *map, const char *signal);

#endif
