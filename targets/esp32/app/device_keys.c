/* SPDX-License-Identifier: MIT */
#include "app/device_keys.h"

#include "net/network.h"
#include "step_pins.h"
#include "store/nvs_device.h"

#include <stdlib.h>

_Static_assert((unsigned)NO_PIN == (unsigned)DEVICE_NO_PIN, "no pin is the same number in both");

#define LEGAL(pin, signal, legal) legal,
static const uint64_t legal_pins[] = {BOARD_PIN_KEYS(LEGAL)};
_Static_assert(sizeof legal_pins / sizeof legal_pins[0] == DEVICE_PINS, "each key's pin has its mask");

/* Buses are not in the map: their pins are the board's. */
static struct device_wiring wiring_of(const struct pin_map *map) {
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

/* ---- the storage and the network ---- */

/* @param ctx  struct nvs_store */
static bool keep_wiring(void *ctx, const struct device_wiring *wiring, const struct device_wiring *before) {
    return nvs_device_keep_wiring(ctx, wiring, before);
}

static bool keep_network(void *ctx, const struct device_network *network,
                         const struct device_network *before) {
    return nvs_device_keep_network(ctx, network, before);
}

static void join(void *ctx) {
    (void)ctx;
    network_join_stored();
}

struct device *device_keys_create(const struct pin_map *map, struct nvs_store *store) {
    static const struct device_ops ops = {
        .keep_wiring = keep_wiring, .keep_network = keep_network, .join = join};
    struct device *device = malloc(sizeof *device);
    if (device == NULL)
        return NULL;
    *device = (struct device){.ops = &ops,
                              .ctx = store,
                              .legal = legal_pins,
                              .encoder_filter_ns = BOARD_ENCODER_FILTER_NS,
                              .ethernet_host = BOARD_ETH_SPI_HOST,
                              .wiring = wiring_of(map)};
    bool trial = nvs_device_load_network(store, &device->network, &device->before);
    device_begin(device, trial, 0);
    return device;
}
