/* SPDX-License-Identifier: MIT
 * The cold tier of the HAL (core/hal/hal.h). */
#include "hal/pic32mz_hal.h"

#include "hal/hal.h"
#include "io/switch_timer.h"

uint32_t hal_time_us(const struct hal *hal) {
    (void)hal;
    return system_time_us();
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
    bool pin_high = high != hal->inputs.wire[INPUT_PROBE].active_high;
    if (hal->step.probe_mask != 0)
        hal->step.probe_level = pin_high ? hal->step.probe_mask : 0;
}

void hal_switch_timer_start(struct hal *hal, uint32_t us) {
    (void)hal;
    switch_timer_start(us);
}

void hal_inputs_read(const struct hal *hal, struct hal_inputs *inputs) {
    inputs_read(&hal->inputs, inputs);
}
