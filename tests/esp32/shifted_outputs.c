/* SPDX-License-Identifier: MIT
 * Outputs of a board with shift registers: the word that they show first, and the bits that tasks change,
 * with drivers that note what the firmware asks of them. */
#include "check.h"
#include "gcode/gcode.h"
#include "hal/spindle_pwm.h"
#include "io/outputs.h"

#include "driver/gpio.h"
#include "driver/ledc.h"
#include "esp_rom_gpio.h"
#include "hal/step_engine.h"
#include "soc/gpio_sig_map.h"
#include "soc/gpio_struct.h"

#include <stdlib.h>
#include <string.h>

enum { NOT_SET = -1 };

gpio_dev_t GPIO;
static uint32_t signal_at[64], cut_high, cut_low;
static bool frozen;

void esp_rom_gpio_connect_out_signal(uint32_t gpio, uint32_t signal, bool inverted, bool enable_inverted) {
    (void)inverted, (void)enable_inverted;
    signal_at[gpio] = signal;
}

void step_engine_cut(struct hal_step *hal, uint32_t high, uint32_t low) {
    (void)hal;
    cut_high = high;
    cut_low = low;
}

void step_engine_freeze(struct hal_step *hal) {
    (void)hal;
    CHECK(cut_low != 0); /* the word comes before */
    frozen = true;
}

static int level[64];
static bool driven[64];
static uint32_t first_word, shifts;

esp_err_t gpio_set_level(gpio_num_t gpio, uint32_t wanted) {
    CHECK((int)gpio < 40);
    level[gpio] = (int)wanted;
    return ESP_OK;
}

esp_err_t gpio_config(const gpio_config_t *config) {
    CHECK(config->mode == GPIO_MODE_OUTPUT);
    for (unsigned gpio = 0; gpio < 40; gpio++) {
        if ((config->pin_bit_mask >> gpio & 1) == 0)
            continue;
        CHECK(level[gpio] != NOT_SET); /* first the level */
        driven[gpio] = true;
    }
    return ESP_OK;
}

void _esp_error_check_failed(esp_err_t code, const char *file, int line, const char *function,
                             const char *expression) {
    (void)code;
    (void)file;
    (void)line;
    (void)function;
    (void)expression;
    abort();
}

void step_shift_out(uint32_t word);
void step_shift_out(uint32_t word) {
    first_word = word;
    shifts++;
    for (unsigned gpio = 0; gpio < 64; gpio++)
        CHECK(!driven[gpio]); /* before anything else */
}

bool spindle_pwm_init(const struct output_wire *wire) {
    return wire->pin == PIN_SPINDLE_PWM;
}

static uint32_t bit(unsigned pin) {
    return 1u << (pin - BOARD_I2SO_FIRST);
}

/* Of drivers, which are on at low. */
static uint32_t enables(void) {
    return bit(PIN_ENABLE_X) | bit(PIN_ENABLE_Y) | bit(PIN_ENABLE_Z) | bit(PIN_ENABLE_A) | bit(PIN_ENABLE_B);
}

static struct pin_map map;
static struct outputs outputs;
static uint32_t shifted;

static void start(void) {
    struct output_wire wire[SWITCH_COUNT];
    memset(level, NOT_SET, sizeof level);
    pin_map_init(&map);
    outputs_make_safe(&map);
    for (unsigned n = 0; n < SWITCH_COUNT; n++)
        wire[n] = (struct output_wire){.pin = NO_PIN};
    const unsigned enable[] = {PIN_ENABLE_X, PIN_ENABLE_Y, PIN_ENABLE_Z, PIN_ENABLE_A, PIN_ENABLE_B};
    for (unsigned ax = 0; ax < BOARD_AXIS_COUNT; ax++)
        wire[SWITCH_ENABLE_X + ax] = (struct output_wire){.pin = (uint8_t)enable[ax], .active_high = false};
    wire[SWITCH_SPINDLE_PWM] = (struct output_wire){.pin = PIN_SPINDLE_PWM, .active_high = true};
    wire[SWITCH_FLOOD] = (struct output_wire){.pin = PIN_COOLANT_FLOOD, .active_high = true};
    wire[SWITCH_DIGITAL] = (struct output_wire){.pin = PIN_MISC_OUT_0, .active_high = true};
    shifted = first_word;
    CHECK(outputs_init(&outputs, wire, &shifted));
}

static void everything_is_off_at_first(void) {
    CHECK(shifts == 1 && first_word == enables());
    CHECK(level[PIN_SPINDLE_PWM] == 0 && driven[PIN_SPINDLE_PWM] && level[PIN_COOLANT_FLOOD] == 0);
    CHECK(!driven[PIN_I2SO_BCK] && !driven[PIN_I2SO_WS]);
}

static void drivers_are_switched_together(void) {
    outputs_motors(&outputs, true, false);
    CHECK(shifted == 0);
    outputs_motors(&outputs, true, true); /* $4 */
    CHECK(shifted == enables());
    outputs_motors(&outputs, false, false);
    CHECK(shifted == enables());
}

static void outputs_of_registers_and_pins_side_by_side(void) {
    outputs_digital(&outputs, 1);
    outputs_coolant(&outputs, COOLANT_FLOOD);
    CHECK(shifted == (enables() | bit(PIN_MISC_OUT_0)) && level[PIN_COOLANT_FLOOD] == 1);
    outputs_digital(&outputs, 0);
    outputs_coolant(&outputs, 0);
    CHECK(shifted == enables() && level[PIN_COOLANT_FLOOD] == 0);
}

/* Whatever is on, and waves are led back to the pins' own levels. */
static void a_panic_switches_all_off(void) {
    memset((void *)(uintptr_t)&GPIO, 0, sizeof GPIO);
    memset(signal_at, 0, sizeof signal_at);
    outputs_cut(&outputs, NULL);
    CHECK(cut_low == bit(PIN_MISC_OUT_0) && cut_high == 0 && frozen);
    const uint32_t low[2] = {GPIO.out_w1tc, GPIO.out1_w1tc.val};
    CHECK((low[PIN_COOLANT_FLOOD / 32] >> PIN_COOLANT_FLOOD % 32 & 1) == 1);
    CHECK((low[PIN_SPINDLE_PWM / 32] >> PIN_SPINDLE_PWM % 32 & 1) == 1);
    CHECK(GPIO.out_w1ts == 0 && GPIO.out1_w1ts.val == 0);
    CHECK(signal_at[PIN_SPINDLE_PWM] == SIG_GPIO_OUT_IDX);
}

int main(void) {
    start();
    everything_is_off_at_first();
    drivers_are_switched_together();
    outputs_of_registers_and_pins_side_by_side();
    a_panic_switches_all_off();
    return report();
}
