/* SPDX-License-Identifier: MIT
 * Axis masks -> bits of the two GPIO banks, as tables: the step ISR writes ports and never loops over axes.
 * The tables are filled at start, from whatever pins the axes have. [task] No register is touched here. */
#ifndef WIFICNC_ESP32_STEP_PINS_H
#define WIFICNC_ESP32_STEP_PINS_H

#include "base/axis.h"

#include <stdbool.h>
#include <stdint.h>

enum { GPIO_BANKS = 2, AXIS_MASKS = 1 << AXIS_COUNT };

/** A pin number that is none. */
enum { GPIO_NONE = 0xFF };

/** Bits of GPIO 0..31 and of GPIO 32..63. */
struct gpio_bits {
    uint32_t bank[GPIO_BANKS];
};

struct step_pins {
    struct gpio_bits step[AXIS_MASKS]; /* [axes]: their step lines */
    struct gpio_bits dir[AXIS_MASKS];  /* [axes]: their direction lines */
};

/** Fill the tables. @param step, dir  GPIO numbers of the axes, GPIO_NONE: the axis has none
 *  @return false: a pin is beyond both banks; the tables are as they were */
bool step_pins_set(struct step_pins *pins, const uint8_t step[AXIS_COUNT], const uint8_t dir[AXIS_COUNT]);

#endif
