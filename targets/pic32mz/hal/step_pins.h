/* SPDX-License-Identifier: MIT
 * Axis masks -> bits of the ports, as tables: the step ISR writes ports and never loops over axes. The tables
 * are filled at start. [task] No register is touched here. */
#ifndef WIFICNC_PIC32MZ_STEP_PINS_H
#define WIFICNC_PIC32MZ_STEP_PINS_H

#include "base/axis.h"
#include "chip/sfr.h"

#include <stdbool.h>
#include <stdint.h>

enum { AXIS_MASKS = 1 << AXIS_COUNT };

/** A pin number (16 * port + bit) that is none. */
enum { PIC_PIN_NONE = 0xFF };

/** Bits of ports A .. G. One more, so that a table's row is 16 bytes. */
struct port_bits {
    uint16_t port[PORT_COUNT + 1];
};

struct step_pins {
    struct port_bits step[AXIS_MASKS]; /* [axes]: their step lines */
    struct port_bits dir[AXIS_MASKS];  /* [axes]: their direction lines */
};

/** Fill the tables. @param step, dir  pins of the axes, PIC_PIN_NONE: the axis has none
 *  @return false: a pin is beyond port G; the tables are as they were */
bool step_pins_set(struct step_pins *pins, const uint8_t step[AXIS_COUNT], const uint8_t dir[AXIS_COUNT]);

#endif
