/* SPDX-License-Identifier: MIT
 * Cold tier of the HAL: what a target supplies to the task side. A missing function fails the link.
 * The hot tier is hal/hal_step.h, found by include path in targets/<target>/. Table: core/hal/README.md. */
#ifndef WIFICNC_HAL_HAL_H
#define WIFICNC_HAL_HAL_H

#include "base/axis.h"

#include <stdbool.h>
#include <stdint.h>

/** A target's own context: outputs and clock of one machine. */
struct hal;

/** [task] Time since power-on, us; wraps at 2^32. On the host: virtual time. */
uint32_t hal_time_us(const struct hal *hal);

/** [task] Spindle: direction -1 (counter-clockwise), 0 (off), 1 (clockwise); rpm >= 0. Takes effect at once.
 */
void hal_spindle_set(struct hal *hal, int direction, float rpm);

/** [task] Coolant outputs: COOLANT_ bits of gcode/gcode.h. Takes effect at once. */
void hal_coolant_set(struct hal *hal, uint8_t bits);

/** Inputs, debounced. limit_* and probe: level of the line, 1 = high ($5 and $6 say what it means). The
 * others: 1 = asks for its action; the board file knows their polarity. */
struct hal_inputs {
    axis_mask_t limit_min, limit_max; /* a board with one line an axis reports it in both */
    bool probe;
    bool door, hold, start, reset, estop;
};

/** [task] Levels now. */
void hal_inputs_read(const struct hal *hal, struct hal_inputs *inputs);

#endif
