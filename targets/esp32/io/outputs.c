/* SPDX-License-Identifier: MIT */
#include "io/outputs.h"

#include "gcode/gcode.h"
#include "hal/spindle_pwm.h"
#include "hal/step_shift.h"
#include "io/charge_pump.h"
#include "io/output_cut.h"
#include "step_pins.h"

#include "driver/gpio.h"
#include "driver/ledc.h"
#include "esp_attr.h"
#include "esp_rom_gpio.h"
#include "soc/gpio_sig_map.h"

#define SERVO_HZ        50u
#define SERVO_BITS      14 /* the most that the S3 has: 1.2 us */
#define SERVO_PERIOD_US (1000000u / SERVO_HZ)

enum { SERVO_TIMER = LEDC_TIMER_1, SERVO_CHANNEL = LEDC_CHANNEL_1, SERVO_MODE = LEDC_LOW_SPEED_MODE };

static void make_output(uint8_t gpio, bool level) {
    ESP_ERROR_CHECK(gpio_set_level((gpio_num_t)gpio, level)); /* first the level, then the driver */
    /* Not gpio_set_direction(): the pins of JTAG would stay JTAG's. */
    const gpio_config_t config = {.pin_bit_mask = 1ull << gpio, .mode = GPIO_MODE_OUTPUT};
    ESP_ERROR_CHECK(gpio_config(&config));
}

/* Shift registers come first: until they have their word, they show anything. */
void outputs_make_safe(const struct pin_map *map) {
    uint32_t word = 0;
    for (const struct pin_wire *wire = map->wire; wire < map->wire + SIGNAL_COUNT; wire++)
        if (step_shift_has(wire->gpio) && !wire->active_high)
            word |= step_shift_bit(wire->gpio);
    if (BOARD_I2SO_COUNT > 0)
        step_shift_out(word);
    for (const struct pin_wire *wire = map->wire; wire < map->wire + SIGNAL_COUNT; wire++)
        if (wire->output && wire->gpio != NO_PIN && !step_shift_has(wire->gpio))
            make_output(wire->gpio, !wire->active_high);
}

/* Seen by the step interrupt's next event, or by step_engine_show(). */
static void shift(uint32_t *shifted, uint32_t bit, bool level) {
    if (level)
        (void)__atomic_fetch_or(shifted, bit, __ATOMIC_RELAXED);
    else
        (void)__atomic_fetch_and(shifted, ~bit, __ATOMIC_RELAXED);
}

static void set(const struct outputs *outputs, enum switch_output output, bool on) {
    const struct output_wire *wire = &outputs->wire[output];
    if (step_shift_has(wire->pin))
        shift(outputs->shifted, step_shift_bit(wire->pin), on == wire->active_high);
    else if (wire->pin != NO_PIN)
        gpio_set_level((gpio_num_t)wire->pin, on == wire->active_high);
}

static bool start_servo(const struct output_wire *wire) {
    const ledc_timer_config_t timer = {.speed_mode = (ledc_mode_t)SERVO_MODE,
                                       .duty_resolution = (ledc_timer_bit_t)SERVO_BITS,
                                       .timer_num = (ledc_timer_t)SERVO_TIMER,
                                       .freq_hz = SERVO_HZ,
                                       .clk_cfg = LEDC_AUTO_CLK};
    const ledc_channel_config_t channel = {.gpio_num = wire->pin,
                                           .speed_mode = (ledc_mode_t)SERVO_MODE,
                                           .channel = (ledc_channel_t)SERVO_CHANNEL,
                                           .timer_sel = (ledc_timer_t)SERVO_TIMER,
                                           .duty = 0,
                                           .flags = {.output_invert = !wire->active_high}};
    return ledc_timer_config(&timer) == ESP_OK && ledc_channel_config(&channel) == ESP_OK;
}

bool outputs_init(struct outputs *outputs, const struct output_wire wire[SWITCH_COUNT], uint32_t *shifted) {
    outputs->shifted = shifted;
    for (unsigned output = 0; output < SWITCH_COUNT; output++)
        outputs->wire[output] = wire[output];
    outputs->drivers_off = (struct output_cut){.high = {0}};
    for (unsigned output = SWITCH_ENABLE; output <= SWITCH_ENABLE_LAST; output++)
        output_cut_add(&outputs->drivers_off, &wire[output], !wire[output].active_high);
    const struct output_wire *pwm = &outputs->wire[SWITCH_SPINDLE_PWM], *servo = &outputs->wire[SWITCH_SERVO];
    const struct output_wire *pump = &outputs->wire[SWITCH_CHARGE_PUMP];
    return (pwm->pin == NO_PIN || spindle_pwm_init(pwm)) && (servo->pin == NO_PIN || start_servo(servo)) &&
           (pump->pin == NO_PIN || charge_pump_init(pump));
}

void outputs_motors(const struct outputs *outputs, bool on, bool invert) {
    for (unsigned output = SWITCH_ENABLE; output <= SWITCH_ENABLE_LAST; output++)
        set(outputs, (enum switch_output)output, on != invert);
}

/* Direction first, so that the spindle never starts the wrong way round. */
void outputs_spindle(struct outputs *outputs, int direction) {
    set(outputs, SWITCH_SPINDLE_DIR, direction < 0);
    set(outputs, SWITCH_SPINDLE_ENABLE, direction != 0);
}

bool outputs_have_pwm(const struct outputs *outputs) {
    return outputs->wire[SWITCH_SPINDLE_PWM].pin != NO_PIN;
}

bool outputs_have_servo(const struct outputs *outputs) {
    return outputs->wire[SWITCH_SERVO].pin != NO_PIN;
}

void outputs_servo(uint16_t pulse_us) {
    uint32_t duty = (pulse_us * (1u << SERVO_BITS) + SERVO_PERIOD_US / 2) / SERVO_PERIOD_US;
    ledc_set_duty((ledc_mode_t)SERVO_MODE, (ledc_channel_t)SERVO_CHANNEL, duty);
    ledc_update_duty((ledc_mode_t)SERVO_MODE, (ledc_channel_t)SERVO_CHANNEL);
}

void outputs_coolant(struct outputs *outputs, uint8_t bits) {
    set(outputs, SWITCH_FLOOD, (bits & COOLANT_FLOOD) != 0);
    set(outputs, SWITCH_MIST, (bits & COOLANT_MIST) != 0);
}

void outputs_digital(const struct outputs *outputs, uint8_t bits) {
    for (unsigned output = SWITCH_DIGITAL; output <= SWITCH_LAST_DIGITAL; output++)
        set(outputs, (enum switch_output)output, (bits >> (output - SWITCH_DIGITAL) & 1) != 0);
}

void IRAM_ATTR outputs_cut(const struct outputs *outputs, struct hal_step *step) {
    static const DRAM_ATTR uint8_t waves[] = {SWITCH_SPINDLE_PWM, SWITCH_CHARGE_PUMP, SWITCH_SERVO};
    struct output_cut cut = {.high = {0}};
    for (unsigned output = SWITCH_SPINDLE_ENABLE; output < SWITCH_COUNT; output++)
        output_cut_add(&cut, &outputs->wire[output], !outputs->wire[output].active_high);
    output_cut_pins(&cut);
    for (unsigned wave = 0; wave < sizeof waves; wave++) {
        const uint8_t pin = outputs->wire[waves[wave]].pin;
        if (pin != NO_PIN && !step_shift_has(pin))
            esp_rom_gpio_connect_out_signal(pin, SIG_GPIO_OUT_IDX, false, false);
    }
    step_engine_cut(step, cut.high[SHIFTED_BANK], cut.low[SHIFTED_BANK]);
    step_engine_freeze(step);
}

bool outputs_have_pump(const struct outputs *outputs) {
    return outputs->wire[SWITCH_CHARGE_PUMP].pin != NO_PIN;
}
