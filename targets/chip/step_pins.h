/* SPDX-License-Identifier: MIT
 * Axis masks -> bits of the pins' banks, as tables: the step ISR writes banks and never loops over axes. The
 * tables are filled at start, from whatever pins the motors have; both motors of an axis are in its bits, so
 * a second one costs the ISR nothing. [task] No register is touched here. */
#ifndef WIFICNC_CHIP_STEP_PINS_H
#define WIFICNC_CHIP_STEP_PINS_H

#include "base/axis.h"
#include "gang.h"
#include "hal/pin_banks.h" // PIN_BANKS, PIN_BANK_WIDTH: of the target

#include <stdbool.h>
#include <stdint.h>

enum { AXIS_MASKS = 1 << AXIS_COUNT };

/** A pin number that is none. */
enum { NO_PIN = 0xFF };

struct pin_bits {
    pin_bank_t bank[PIN_BANKS_PADDED];
};

struct step_pins {
    struct pin_bits step[AXIS_MASKS]; /* [axes]: their step lines */
    struct pin_bits dir[AXIS_MASKS];  /* [axes]: their direction lines */
};

/** Bits of the pins of these motors. @param motors  bit n = motor n */
struct pin_bits step_pins_bits(const uint8_t pin[AXIS_COUNT], unsigned motors);

/** Fill the tables. @param step, dir  pins of the motors, NO_PIN: it has none
 *  @return false: a pin is beyond all banks; the tables are as they were */
bool step_pins_set(struct step_pins *pins, const struct gang *gang, const uint8_t step[AXIS_COUNT],
                   const uint8_t dir[AXIS_COUNT]);

/** The first motors of these axes make no steps from now on, nor the second ones of those. */
void step_pins_hold(struct step_pins *pins, const struct gang *gang, const uint8_t step[AXIS_COUNT],
                    axis_mask_t first, axis_mask_t second);

#endif
