/* SPDX-License-Identifier: MIT
 * GPIO registers: each access first looks at what the one before has written. */
#pragma once

#include_next "soc/gpio_struct.h"

#include "emulated.h"

extern gpio_dev_t gpio;

static inline gpio_dev_t *emulated_gpio(void) {
    const uint32_t set = gpio.out_w1ts, clear = gpio.out_w1tc;
    gpio.out_w1ts = gpio.out_w1tc = 0;
    emulated.negative |= set >> FIRST_DIR_GPIO;
    emulated.negative &= ~(clear >> FIRST_DIR_GPIO);
    for (unsigned ax = 0; ax < EMULATED_AXES; ax++)
        if ((set >> (FIRST_STEP_GPIO + ax) & 1) != 0)
            emulated.steps[ax] += (emulated.negative >> ax & 1) != 0 ? -1 : 1;
    return &gpio;
}

#define GPIO (*emulated_gpio())
