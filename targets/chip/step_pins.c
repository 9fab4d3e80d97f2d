/* SPDX-License-Identifier: MIT */
#include "step_pins.h"

static bool fits(const uint8_t pin[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if (pin[ax] != NO_PIN && pin[ax] >= PIN_BANKS * PIN_BANK_WIDTH)
            return false;
    return true;
}

static struct pin_bits bits_of(const uint8_t pin[AXIS_COUNT], unsigned axes) {
    struct pin_bits bits = {{0}};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        if ((axes >> ax & 1) == 0 || pin[ax] == NO_PIN)
            continue;
        pin_bank_t *bank = &bits.bank[pin[ax] / PIN_BANK_WIDTH];
        *bank = (pin_bank_t)(*bank | (uint32_t)1 << pin[ax] % PIN_BANK_WIDTH);
    }
    return bits;
}

bool step_pins_set(struct step_pins *pins, const uint8_t step[AXIS_COUNT], const uint8_t dir[AXIS_COUNT]) {
    if (!fits(step) || !fits(dir))
        return false;
    /* A table of all combinations, because the step interrupt has no time to look for the pins of each
     * axis. */
    for (unsigned axes = 0; axes < AXIS_MASKS; axes++) {
        pins->step[axes] = bits_of(step, axes);
        pins->dir[axes] = bits_of(dir, axes);
    }
    return true;
}
