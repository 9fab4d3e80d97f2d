/* SPDX-License-Identifier: MIT */
#include "app/device_keys.h"

#include "step_pins.h"

#include <stdlib.h>

_Static_assert((unsigned)NO_PIN == (unsigned)DEVICE_NO_PIN, "no pin is the same number in both");

#define LEGAL(pin, signal, legal) legal,
static const uint64_t legal_pins[] = {BOARD_PIN_KEYS(LEGAL)};
_Static_assert(sizeof legal_pins / sizeof legal_pins[0] == DEVICE_PINS, "each key's pin has its mask");

/* Buses are not in the map: their pins are the board's. */
struct device_wiring device_keys_wiring(const struct pin_map *map) {
    static const struct {
        uint8_t pin, signal;
    } rows[DEVICE_PINS] = {
#define ROW(pin, signal, legal) {(uint8_t)(pin), signal},
        BOARD_PIN_KEYS(ROW)};
    struct device_wiring wiring = {.estop_high = map->wire[SIGNAL_ESTOP].active_high};
    for (unsigned n = 0; n < DEVICE_PINS; n++) {
        const uint8_t gpio = map->wire[rows[n].signal].gpio;
        wiring.pin[n] = gpio == NO_PIN && legal_pins[n] == 0 ? rows[n].pin : gpio;
    }
    return wiring;
}

struct device *device_keys_create(const struct pin_map *map) {
    static const struct device_ops ops = {NULL, NULL, NULL};
    struct device *device = malloc(sizeof *device);
    if (device == NULL)
        return NULL;
    *device = (struct device){.ops = &ops,
                              .legal = legal_pins,
                              .encoder_filter_ns = BOARD_ENCODER_FILTER_NS,
                              .ethernet_host = BOARD_ETH_SPI_HOST,
                              .wiring = device_keys_wiring(map)};
    device_begin(device, false, 0);
    return device;
}
