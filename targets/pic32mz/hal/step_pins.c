/* SPDX-License-Identifier: MIT */
#include "hal/step_pins.h"

static bool fits(const uint8_t pin[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if (pin[ax] != PIC_PIN_NONE && pin[ax] >= PORT_COUNT * PORT_WIDTH)
            return false;
    return true;
}

static struct port_bits bits_of(const uint8_t pin[AXIS_COUNT], unsigned axes) {
    struct port_bits bits = {{0}};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if ((axes >> ax & 1) != 0 && pin[ax] != PIC_PIN_NONE)
            bits.port[pin[ax] / PORT_WIDTH] =
                (uint16_t)(bits.port[pin[ax] / PORT_WIDTH] | 1u << pin[ax] % PORT_WIDTH);
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
