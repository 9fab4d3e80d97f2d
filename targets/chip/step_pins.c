/* SPDX-License-Identifier: MIT */
#include "step_pins.h"

static bool fits(const uint8_t pin[AXIS_COUNT]) {
    for (unsigned motor = 0; motor < AXIS_COUNT; motor++)
        if (pin[motor] != NO_PIN && pin[motor] >= PIN_BANKS * PIN_BANK_WIDTH)
            return false;
    return true;
}

struct pin_bits step_pins_bits(const uint8_t pin[AXIS_COUNT], unsigned motors) {
    struct pin_bits bits = {{0}};
    for (unsigned motor = 0; motor < AXIS_COUNT; motor++) {
        if ((motors >> motor & 1) == 0 || pin[motor] == NO_PIN)
            continue;
        pin_bank_t *bank = &bits.bank[pin[motor] / PIN_BANK_WIDTH];
        *bank = (pin_bank_t)(*bank | (uint32_t)1 << pin[motor] % PIN_BANK_WIDTH);
    }
    return bits;
}

void step_pins_hold(struct step_pins *pins, const struct gang *gang, const uint8_t step[AXIS_COUNT],
                    axis_mask_t first, axis_mask_t second) {
    /* A table of all combinations, because the step interrupt has no time to look for the pins of each
     * axis. */
    for (unsigned axes = 0; axes < AXIS_MASKS; axes++)
        pins->step[axes] = step_pins_bits(step, gang_motors(gang, (axis_mask_t)(axes & ~(unsigned)first),
                                                            (axis_mask_t)(axes & ~(unsigned)second)));
}

bool step_pins_set(struct step_pins *pins, const struct gang *gang, const uint8_t step[AXIS_COUNT],
                   const uint8_t dir[AXIS_COUNT]) {
    if (!fits(step) || !fits(dir))
        return false;
    step_pins_hold(pins, gang, step, 0, 0);
    for (unsigned axes = 0; axes < AXIS_MASKS; axes++)
        pins->dir[axes] = step_pins_bits(dir, gang_motors(gang, (axis_mask_t)axes, (axis_mask_t)axes));
    return true;
}
