/* SPDX-License-Identifier: MIT
 * struct hal of the ESP32: step engine, inputs and outputs of the one machine of this chip. In internal RAM.
 */
#ifndef WIFICNC_CHIP_HAL_H
#define WIFICNC_CHIP_HAL_H

#include "hal/hal.h"
#include "hal/hal_step.h"
#include "io/encoder.h"
#include "io/inputs.h"
#include "io/outputs.h"

struct hal {
    struct hal_step step;
    struct inputs inputs;
    struct outputs outputs;
    struct gang *gang; /* whose motors they are */
    struct hal_ganged ganged;
    struct encoder encoder;
};

/** The RC servo, when outputs_have_servo(). */
extern const struct hal_servo esp32_servo;
/** The charge pump, when outputs_have_pump(). */
extern const struct hal_pump esp32_pump;
/** The spindle's encoder, when encoder_init() found one; with an index line, when that is wired. */
extern const struct hal_encoder esp32_encoder, esp32_indexed_encoder;

#endif
