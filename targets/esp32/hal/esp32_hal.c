/* SPDX-License-Identifier: MIT
 * The cold tier of the HAL (core/hal/hal.h). */
#include "hal/esp32_hal.h"

#include "hal/hal.h"
#include "io/switch_timer.h"

#include "esp_timer.h"

uint32_t hal_time_us(const struct hal *hal) {
    (void)hal;
    return (uint32_t)esp_timer_get_time();
}

void hal_spindle_set(struct hal *hal, const struct hal_spindle *spindle) {
    outputs_spindle(&hal->outputs, spindle->direction, spindle->duty);
}

void hal_coolant_set(struct hal *hal, uint8_t bits) {
    outputs_coolant(&hal->outputs, bits);
}

void hal_digital_set(struct hal *hal, uint8_t bits) {
    outputs_digital(&hal->outputs, bits);
}

void hal_motors_set(struct hal *hal, bool on, bool invert) {
    outputs_motors(&hal->outputs, on, invert);
}

void hal_probe_watch(struct hal *hal, bool high) {
    if (hal->step.probe_mask != 0)
        hal->step.probe_level = high ? hal->step.probe_mask : 0;
}

HAL_ISR void hal_switch_timer_start(struct hal *hal, uint32_t us) {
    (void)hal;
    switch_timer_start(us);
}

HAL_ISR void hal_inputs_read(const struct hal *hal, struct hal_inputs *inputs) {
    inputs_read(&hal->inputs, inputs);
}

static void read_encoder(struct hal *hal, struct hal_encoder_state *out) {
    encoder_read(&hal->encoder, hal_time_us(hal), out);
}

static void set_servo(struct hal *hal, uint16_t pulse_us) {
    (void)hal;
    outputs_servo(pulse_us);
}

const struct hal_servo esp32_servo = {.set = set_servo};
const struct hal_encoder esp32_encoder = {.has_index = false, .read = read_encoder};
const struct hal_encoder esp32_indexed_encoder = {.has_index = true, .read = read_encoder};
