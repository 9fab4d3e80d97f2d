/* SPDX-License-Identifier: MIT
 * Lines of the dial, as BOARD_DIAL_WIRES of pin_config.h lists them, and its select switches. */
#ifndef WIFICNC_CHIP_DIAL_WIRES_H
#define WIFICNC_CHIP_DIAL_WIRES_H

#include "hal/hal.h"

enum dial_line { DIAL_A, DIAL_B, DIAL_X10, DIAL_X100, DIAL_AXIS, DIAL_LINES = DIAL_AXIS + AXIS_COUNT };

struct dial_wire {
    uint8_t pin; /* PIN_NONE: not wired */
    bool active_high;
    uint8_t pull; /* PIN_PULL_ of pin_config.h */
};

/** For BOARD_DIAL_WIRES(). */
#define DIAL_WIRE(pin, active_high, pull) {pin, active_high, pull},

/** Switches of the dial. @param on  bit n = enum dial_line n is on */
static inline void dial_switches(unsigned on, struct hal_dial_state *out) {
    out->x10 = (on >> DIAL_X10 & 1u) != 0;
    out->x100 = (on >> DIAL_X100 & 1u) != 0;
    out->axes = (axis_mask_t)(on >> DIAL_AXIS);
}

#endif
