/* SPDX-License-Identifier: MIT
 * struct hal of the PIC32MZ: step engine, inputs and outputs of the one machine of this chip. */
#ifndef WIFICNC_CHIP_HAL_H
#define WIFICNC_CHIP_HAL_H

#include "hal/hal.h"
#include "hal/hal_step.h"
#include "io/inputs.h"
#include "io/outputs.h"

struct hal {
    struct hal_step step;
    struct inputs inputs;
    struct outputs outputs;
    struct gang *gang; /* whose motors they are */
    struct hal_ganged ganged;
};

#endif
