/* SPDX-License-Identifier: MIT
 * Channels of an I/O module on the pins of an ESP32-S3-DevKitC with octal memory, over a made-up GPIO driver.
 */
#include "io/lines.h"
#include "check.h"
#include "pin_config.h"
#include "step_pins.h"

#include "driver/gpio.h"

#include <stdlib.h>
#include <string.h>

enum { PINS = 64 };

static struct pin {
    bool level, output, input, pull_up, blinked; /* blinked: driven with a level that no one asked for */
    int calls;
} pins[PINS];

esp_err_t gpio_set_level(gpio_num_t gpio, uint32_t level) {
    pins[gpio].level = level != 0;
    return ESP_OK;
}

esp_err_t gpio_config(const gpio_config_t *config) {
    for (unsigned pin = 0; pin < PINS; pin++)
        if ((config->pin_bit_mask >> pin & 1) != 0) {
            pins[pin].calls++;
            pins[pin].input = config->mode == GPIO_MODE_INPUT;
            pins[pin].output = config->mode == GPIO_MODE_OUTPUT;
            /* These tests' outputs are high when their driver is switched on. */
            pins[pin].blinked |= pins[pin].output && !pins[pin].level;
        }
    return ESP_OK;
}

esp_err_t gpio_pullup_en(gpio_num_t gpio) {
    pins[gpio].pull_up = true;
    return ESP_OK;
}

esp_err_t gpio_reset_pin(gpio_num_t gpio) {
    pins[gpio] = (struct pin){.calls = pins[gpio].calls + 1};
    return ESP_OK;
}

int gpio_get_level(gpio_num_t gpio) {
    return pins[gpio].level;
}

void _esp_error_check_failed(esp_err_t code, const char *file, int line, const char *function,
                             const char *expression) {
    printf("%s:%d: %s: %s is %d\n", file, line, function, expression, code);
    exit(1);
}

static struct pin_map map;
static const struct nvs_store nowhere;
static struct lines lines;
static struct channels channels;

static void set(unsigned index, uint32_t value) {
    CHECK(channels_set_value(&channels, index, value));
}

/* Channel 0 is an input on GPIO4, 1 an inverted output on GPIO5. */
static void start(void) {
    memset(pins, 0, sizeof pins);
    pin_map_init(&map);
    lines_init(&lines, &map, &nowhere);
    channels_init(&channels, &lines_ops, &lines);
    set(CHANNELS_IO_COUNT, 2);
    set(CHANNELS_IO_DIRECTION, 2);
    set(CHANNELS_IO_INVERT, 2);
    set(CHANNELS_IO_PIN_0, 4);
    set(CHANNELS_IO_PIN_1, 5);
    channels_apply(&channels);
}

static void pins_are_what_the_channels_say(void) {
    start();
    CHECK(pins[4].input && pins[4].pull_up && !pins[4].output);
    CHECK(pins[5].output && pins[5].level && !pins[5].blinked); /* inverted and off */
    channels_set(&channels, 2, 2);
    CHECK(!pins[5].level);
    pins[4].level = true;
    channels_poll(&channels, 0);
    channels_poll(&channels, 20000);
    CHECK(channels_inputs(&channels) == 1);
}

static void what_stays_is_not_touched_and_what_goes_is_let_go(void) {
    start();
    int calls = pins[5].calls;
    set(CHANNELS_IO_PIN_0, 6);
    channels_apply(&channels);
    CHECK(pins[5].calls == calls && pins[5].output);
    CHECK(!pins[4].input && !pins[4].pull_up && pins[6].input);
    set(CHANNELS_IO_DIRECTION, 3);
    set(CHANNELS_IO_INVERT, 3);
    channels_apply(&channels);
    CHECK(pins[6].output && pins[6].level && !pins[6].blinked);
}

/* Flash, PSRAM, USB, a strapping pin, the W5500, the LED, no pin at all. */
static void pins_that_the_board_needs_are_left_out(void) {
    static const uint8_t bad[] = {30, 35, 19, 45, 46, PIN_LED, 22, 60};
    for (size_t i = 0; i < sizeof bad; i++) {
        start();
        set(CHANNELS_IO_PIN_0, bad[i]);
        CHECK(channels_faults(&channels) == 1);
        channels_apply(&channels);
        CHECK(channels.faults == 1 && channels.inputs == 0 && pins[bad[i]].calls == 0);
        CHECK(pins[5].output);
    }
}

/* A module has no motors: their pins are free. */
static void pins_of_motors_are_free(void) {
    start();
    set(CHANNELS_IO_PIN_0, PIN_STEP_X);
    set(CHANNELS_IO_PIN_1, PIN_PROBE);
    CHECK(channels_faults(&channels) == 0);
}

static void without_a_storage_nothing_is_kept(void) {
    start();
    CHECK(!lines_ops.keep(&lines, &channels.config));
}

int main(void) {
    pins_are_what_the_channels_say();
    what_stays_is_not_touched_and_what_goes_is_let_go();
    pins_that_the_board_needs_are_left_out();
    pins_of_motors_are_free();
    without_a_storage_nothing_is_kept();
    return report();
}
