/* SPDX-License-Identifier: MIT */
#include "hal/step_pins.h"

enum { BANK_WIDTH = 32 };

static bool fits(const uint8_t gpio[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if (gpio[ax] != GPIO_NONE && gpio[ax] >= GPIO_BANKS * BANK_WIDTH)
            return false;
    return true;
}

static struct gpio_bits bits_of(const uint8_t gpio[AXIS_COUNT], unsigned axes) {
    struct gpio_bits bits = {{0}};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if ((axes >> ax & 1) != 0 && gpio[ax] != GPIO_NONE)
            bits.bank[gpio[ax] / BANK_WIDTH] |= (uint32_t)1 << gpio[ax] % BANK_WIDTH;
    return bits;
}

bool step_pins_set(struct step_pins *pins, const uint8_t step[AXIS_COUNT], const uint8_t dir[AXIS_COUNT]) {
    if (!fits(step) || !fits(dir))
        return false;
    for (unsigned axes = 0; axes < AXIS_MASKS; axes++) {
        pins->step[axes] = bits_of(step, axes);
        pins->dir[axes] = bits_of(dir, axes);
    }
    return true;
}
