/* SPDX-License-Identifier: MIT
 * Of the cold tier of the HAL (core/hal/hal.h) what is this chip's own; the rest is in targets/chip. */
#include "hal/chip_hal.h"

#include "hal/hal.h"
#include "hal/step_engine.h"

uint32_t hal_time_us(const struct hal *hal) {
    (void)hal;
    return system_time_us();
}

void hal_estop(struct hal *hal, bool invert, uint16_t dark) {
    outputs_motors(&hal->outputs, false, invert);
    outputs_spindle(&hal->outputs, 0);
    if (outputs_have_pwm(&hal->outputs))
        hal_step_duty(&hal->step, dark);
}

void hal_probe_watch(struct hal *hal, enum hal_probe probe, bool high) {
    const struct input_wire *wire =
        &hal->inputs.wire[probe == HAL_TOOLSETTER ? INPUT_TOOLSETTER : INPUT_PROBE];
    step_engine_watch(&hal->step, wire->pin, high != wire->active_high);
}
