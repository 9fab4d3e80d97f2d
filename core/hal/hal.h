/* SPDX-License-Identifier: MIT
 * Cold tier of the HAL: what a target supplies to the task side. A missing function fails the link.
 * The hot tier is hal/hal_step.h, found by include path in targets/<target>/. Table: core/hal/README.md. */
#ifndef WIFICNC_HAL_HAL_H
#define WIFICNC_HAL_HAL_H

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

#endif
