/* SPDX-License-Identifier: MIT */
#include "io/lines.h"

#include "step_pins.h"
#include "store/nvs_channels.h"

#include "driver/gpio.h"

#include <string.h>

_Static_assert((unsigned)NO_PIN == (unsigned)CHANNELS_NO_PIN, "no pin is the same number in both");

void lines_init(struct lines *lines, const struct pin_map *map, const struct nvs_store *store) {
    *lines = (struct lines){.map = map, .store = store};
    memset(lines->wiring.pin, CHANNELS_NO_PIN, sizeof lines->wiring.pin);
}

static bool can(void *ctx, uint8_t pin, bool output) {
    const struct lines *lines = ctx;
    return pin != NO_PIN && pin_map_is_free(pin, output) && pin != lines->map->wire[SIGNAL_LED].gpio;
}

static bool is_same(const struct channels_wiring *one, const struct channels_wiring *other, unsigned n) {
    return one->pin[n] == other->pin[n] &&
           (((one->outputs ^ other->outputs) | (one->pull_up ^ other->pull_up)) >> n & 1) == 0;
}

/* A pull-up that the pin has not (GPIO34 to 39 of the ESP32) is left out: the call fails, the rest is done.
 */
static void wire_one(const struct channels_wiring *wiring, unsigned n, bool level) {
    gpio_num_t gpio = (gpio_num_t)wiring->pin[n];
    const bool is_output = (wiring->outputs >> n & 1) != 0;
    const gpio_config_t config = {.pin_bit_mask = 1ull << wiring->pin[n],
                                  .mode = is_output ? GPIO_MODE_OUTPUT : GPIO_MODE_INPUT,
                                  .pull_up_en = GPIO_PULLUP_DISABLE,
                                  .pull_down_en = GPIO_PULLDOWN_DISABLE,
                                  .intr_type = GPIO_INTR_DISABLE};
    if (is_output)
        ESP_ERROR_CHECK(gpio_set_level(gpio, level)); /* first the level, then the driver */
    ESP_ERROR_CHECK(gpio_config(&config));
    if (!is_output && (wiring->pull_up >> n & 1) != 0)
        (void)gpio_pullup_en(gpio);
}

static void write_levels(void *ctx, uint16_t levels) {
    const struct lines *lines = ctx;
    for (unsigned n = 0; n < CHANNELS_MAX; n++)
        if ((lines->wiring.outputs >> n & 1) != 0)
            (void)gpio_set_level((gpio_num_t)lines->wiring.pin[n], levels >> n & 1);
}

/* Lines that are as they were are not touched: an output must not blink. */
static void wire(void *ctx, const struct channels_wiring *wiring, uint16_t levels) {
    struct lines *lines = ctx;
    const struct channels_wiring old = lines->wiring;
    for (unsigned n = 0; n < CHANNELS_MAX; n++)
        if (old.pin[n] != CHANNELS_NO_PIN && !is_same(&old, wiring, n))
            (void)gpio_reset_pin((gpio_num_t)old.pin[n]);
    for (unsigned n = 0; n < CHANNELS_MAX; n++)
        if (wiring->pin[n] != CHANNELS_NO_PIN && !is_same(&old, wiring, n))
            wire_one(wiring, n, (levels >> n & 1) != 0);
    lines->wiring = *wiring;
    write_levels(ctx, levels);
}

static uint16_t read_levels(void *ctx) {
    const struct lines *lines = ctx;
    unsigned levels = 0;
    for (unsigned n = 0; n < CHANNELS_MAX; n++)
        if (lines->wiring.pin[n] != CHANNELS_NO_PIN && gpio_get_level((gpio_num_t)lines->wiring.pin[n]) != 0)
            levels |= 1u << n;
    return (uint16_t)levels;
}

static bool keep(void *ctx, const struct channels_config *config) {
    const struct lines *lines = ctx;
    return nvs_channels_keep(lines->store, config);
}

const struct channels_ops lines_ops = {
    .can = can, .wire = wire, .read = read_levels, .write = write_levels, .keep = keep};
