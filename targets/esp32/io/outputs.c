/* SPDX-License-Identifier: MIT */
#include "io/outputs.h"

#include "gcode/gcode.h"
#include "hal/hal.h"
#include "step_pins.h"

#include "driver/gpio.h"
#include "driver/ledc.h"

#define PWM_HZ   5000u /* analogue converters of spindle drives filter it well */
#define PWM_BITS 13    /* 80 MHz / 5 kHz = 16000 > 2^13 */

#define SERVO_HZ        50u
#define SERVO_BITS      14 /* the most that the S3 has: 1.2 us */
#define SERVO_PERIOD_US (1000000u / SERVO_HZ)

enum { PWM_TIMER = LEDC_TIMER_0, PWM_CHANNEL = LEDC_CHANNEL_0, PWM_MODE = LEDC_LOW_SPEED_MODE };
enum { SERVO_TIMER = LEDC_TIMER_1, SERVO_CHANNEL = LEDC_CHANNEL_1 };

static void make_output(uint8_t gpio, bool level) {
    ESP_ERROR_CHECK(gpio_set_level((gpio_num_t)gpio, level)); /* first the level, then the driver */
    ESP_ERROR_CHECK(gpio_set_direction((gpio_num_t)gpio, GPIO_MODE_OUTPUT));
}

void outputs_make_safe(const struct pin_map *map) {
    for (const struct pin_wire *wire = map->wire; wire < map->wire + SIGNAL_COUNT; wire++)
        if (wire->output && wire->gpio != NO_PIN)
            make_output(wire->gpio, !wire->active_high);
}

static void set(const struct outputs *outputs, enum switch_output output, bool on) {
    const struct output_wire *wire = &outputs->wire[output];
    if (wire->pin != NO_PIN)
        gpio_set_level((gpio_num_t)wire->pin, on == wire->active_high);
}

/* What a wire is not there for needs no PWM. */
static bool start_pwm(const struct output_wire *wire, int number, int channel_number, uint32_t hz, int bits) {
    if (wire->pin == NO_PIN)
        return true;
    const ledc_timer_config_t timer = {.speed_mode = (ledc_mode_t)PWM_MODE,
                                       .duty_resolution = (ledc_timer_bit_t)bits,
                                       .timer_num = (ledc_timer_t)number,
                                       .freq_hz = hz,
                                       .clk_cfg = LEDC_AUTO_CLK};
    const ledc_channel_config_t channel = {.gpio_num = wire->pin,
                                           .speed_mode = (ledc_mode_t)PWM_MODE,
                                           .channel = (ledc_channel_t)channel_number,
                                           .timer_sel = (ledc_timer_t)number,
                                           .duty = 0,
                                           .flags = {.output_invert = !wire->active_high}};
    return ledc_timer_config(&timer) == ESP_OK && ledc_channel_config(&channel) == ESP_OK;
}

bool outputs_init(struct outputs *outputs, const struct output_wire wire[SWITCH_COUNT]) {
    for (unsigned output = 0; output < SWITCH_COUNT; output++)
        outputs->wire[output] = wire[output];
    outputs->pump_level = false;
    return start_pwm(&outputs->wire[SWITCH_SPINDLE_PWM], PWM_TIMER, PWM_CHANNEL, PWM_HZ, PWM_BITS) &&
           start_pwm(&outputs->wire[SWITCH_SERVO], SERVO_TIMER, SERVO_CHANNEL, SERVO_HZ, SERVO_BITS);
}

static void set_duty(int channel, uint32_t duty) {
    ledc_set_duty((ledc_mode_t)PWM_MODE, (ledc_channel_t)channel, duty);
    ledc_update_duty((ledc_mode_t)PWM_MODE, (ledc_channel_t)channel);
}

void outputs_motors(const struct outputs *outputs, bool on, bool invert) {
    set(outputs, SWITCH_ENABLE, on != invert);
}

void outputs_spindle(struct outputs *outputs, int direction, uint16_t duty) {
    set(outputs, SWITCH_SPINDLE_DIR, direction < 0);
    set(outputs, SWITCH_SPINDLE_ENABLE, direction != 0);
    if (outputs->wire[SWITCH_SPINDLE_PWM].pin == NO_PIN)
        return;
    uint32_t wanted = direction == 0 ? 0 : duty;
    uint32_t scaled = (wanted * (1u << PWM_BITS) + HAL_DUTY_FULL / 2) / HAL_DUTY_FULL;
    set_duty(PWM_CHANNEL, scaled);
}

bool outputs_have_servo(const struct outputs *outputs) {
    return outputs->wire[SWITCH_SERVO].pin != NO_PIN;
}

void outputs_servo(uint16_t pulse_us) {
    set_duty(SERVO_CHANNEL, (pulse_us * (1u << SERVO_BITS) + SERVO_PERIOD_US / 2) / SERVO_PERIOD_US);
}

void outputs_coolant(struct outputs *outputs, uint8_t bits) {
    set(outputs, SWITCH_FLOOD, (bits & COOLANT_FLOOD) != 0);
    set(outputs, SWITCH_MIST, (bits & COOLANT_MIST) != 0);
}

void outputs_digital(const struct outputs *outputs, uint8_t bits) {
    for (unsigned output = SWITCH_DIGITAL; output <= SWITCH_LAST_DIGITAL; output++)
        set(outputs, (enum switch_output)output, (bits >> (output - SWITCH_DIGITAL) & 1) != 0);
}

void outputs_pump(struct outputs *outputs) {
    outputs->pump_level = !outputs->pump_level;
    set(outputs, SWITCH_CHARGE_PUMP, outputs->pump_level);
}
