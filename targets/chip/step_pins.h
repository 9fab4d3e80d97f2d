/* SPDX-License-Identifier: MIT
 * Axis masks -> bits of the pins' banks, as tables: the step ISR writes banks and never loops over axes. The
 * tables are filled at start, from whatever pins the axes have. [task] No register is touched here. */
#ifndef WIFICNC_CHIP_STEP_PINS_H
#define WIFICNC_CHIP_STEP_PINS_H

#include "base/axis.h"
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

/** Fill the tables. @param step, dir  pins of the axes, NO_PIN: the axis has none
 *  @return false: a pin is beyond all banks; the tables are as they were */
bool step_pins_set(struct step_pins *pins, const uint8_t step[AXIS_COUNT], const uint8_t dir[AXIS_COUNT]);

#endif
