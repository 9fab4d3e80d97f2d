/* SPDX-License-Identifier: MIT
 * Motor enables, spindle, coolant and digital outputs. [task] The spindle's PWM is OC8 on
 * timer 6. */
#ifndef WIFICNC_PIC32MZ_OUTPUTS_H
#define WIFICNC_PIC32MZ_OUTPUTS_H

#include "base/axis.h"
#include "wires.h"

#include <stdbool.h>
#include <stdint.h>

enum switch_output {
    SWITCH_ENABLE, /* of all motors */
    SWITCH_ENABLE_MOTOR,
    SWITCH_SPINDLE_ENABLE = SWITCH_ENABLE_MOTOR + AXIS_COUNT,
    SWITCH_SPINDLE_DIR, /* on: counter-clockwise */
    SWITCH_SPINDLE_PWM,
    SWITCH_FLOOD,
    SWITCH_MIST,
    SWITCH_CHARGE_PUMP,
    SWITCH_LED,
    SWITCH_DIGITAL, /* P0 of M62 .. M65 */
    SWITCH_LAST_DIGITAL = SWITCH_DIGITAL + 4,
    SWITCH_COUNT
};

struct outputs {
    struct output_wire wire[SWITCH_COUNT];
};

/** [start] Every output of the board off, before anything else runs; also step and direction lines. */
void outputs_make_safe(void);

/** [start] @param wire  is copied */
void outputs_init(struct outputs *outputs, const struct output_wire wire[SWITCH_COUNT]);

/** Motor drivers on or off; the LED shows it. @param invert  $4 */
void outputs_motors(const struct outputs *outputs, bool on, bool invert);

/** Direction and enable. @param direction -1, 0, 1 */
void outputs_spindle(const struct outputs *outputs, int direction);

/** Is there a PWM output of the spindle? */
bool outputs_have_pwm(const struct outputs *outputs);

/** @param bits  COOLANT_ of gcode/gcode.h */
void outputs_coolant(const struct outputs *outputs, uint8_t bits);

/** @param bits  digital outputs of M62 .. M65, bit n = Pn */
void outputs_digital(const struct outputs *outputs, uint8_t bits);

#endif
