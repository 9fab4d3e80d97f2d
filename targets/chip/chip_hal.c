/* SPDX-License-Identifier: MIT
 * The part of the HAL's cold tier (core/hal/hal.h) that is the same on every chip: it passes on to io/. */
#include "hal/hal.h"

#include "chip_ganged.h"
#include "hal/chip_hal.h" // struct hal, of the target
#include "hal/step_engine.h"
#include "io/switch_timer.h"
#include "pin_config.h"

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

static bool has_input(const struct hal *hal, unsigned input) {
    return hal->inputs.wire[input].pin != NO_PIN;
}

/* Axes whose second motor has a switch of the kind that homing looks at. */
static axis_mask_t switched(const struct hal *hal) {
    const struct gang *gang = hal->gang;
    unsigned axes = 0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        const unsigned motor = gang->second[ax];
        const bool home = (BOARD_HOME_AXES >> ax & 1u) != 0;
        if ((gang->axes >> ax & 1) != 0 &&
            (home ? has_input(hal, INPUT_HOME + motor)
                  : has_input(hal, INPUT_LIMIT_MIN + motor) || has_input(hal, INPUT_LIMIT_MAX + motor)))
            axes |= 1u << ax;
    }
    return (axis_mask_t)axes;
}

static void take_motor(struct hal *hal, unsigned axis, unsigned from) {
    gang_take(hal->gang, axis, from);
    step_engine_regroup(&hal->step);
    hal->ganged.axes = hal->gang->axes;
    hal->ganged.switched = switched(hal);
}

const struct hal_ganged *chip_ganged(struct hal *hal, struct gang *gang) {
    const unsigned later_axes = ((1u << BOARD_AXIS_COUNT) - 1) & ~1u;
    hal->gang = gang;
    hal->ganged = (struct hal_ganged){.axes = gang->axes,
                                      .fixed = gang->axes,
                                      .switched = switched(hal),
                                      .spare = (axis_mask_t)(later_axes & ~(unsigned)gang->axes),
                                      .take = take_motor,
                                      .hold = hold_motors};
    return &hal->ganged;
}

HAL_ISR void hal_switch_timer_start(struct hal *hal, uint32_t us) {
    (void)hal;
    switch_timer_start(us);
}

HAL_ISR void hal_inputs_read(const struct hal *hal, struct hal_inputs *inputs) {
    inputs_read(&hal->inputs, inputs);
}
