/* SPDX-License-Identifier: MIT
 * The part of the HAL's cold tier (core/hal/hal.h) that is the same on every chip: it passes on to io/. */
#include "hal/hal.h"

#include "chip_ganged.h"
#include "hal/chip_hal.h" // struct hal, of the target
#include "hal/step_engine.h"
#include "io/switch_timer.h"

#include <stddef.h>

struct duty_register hal_spindle_pwm(struct hal *hal, uint32_t hz) {
    return outputs_have_pwm(&hal->outputs) ? spindle_pwm_tune(hz) : (struct duty_register){0, 0, 0};
}

void hal_spindle_set(struct hal *hal, const struct hal_spindle *spindle) {
    outputs_spindle(&hal->outputs, spindle->direction);
    if (!spindle->keeps_duty && outputs_have_pwm(&hal->outputs))
        hal_step_duty(&hal->step, spindle->duty);
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

static void hold_motors(struct hal *hal, axis_mask_t first, axis_mask_t second) {
    step_engine_hold(&hal->step, first, second);
}

const struct hal_ganged *chip_ganged(struct hal *hal, const struct gang *gang) {
    hal->ganged = (struct hal_ganged){.axes = gang->axes, .hold = hold_motors};
    return gang->axes != 0 ? &hal->ganged : NULL;
}

HAL_ISR void hal_switch_timer_start(struct hal *hal, uint32_t us) {
    (void)hal;
    switch_timer_start(us);
}

HAL_ISR void hal_inputs_read(const struct hal *hal, struct hal_inputs *inputs) {
    inputs_read(&hal->inputs, inputs);
}
