/* SPDX-License-Identifier: MIT
 * Motor enable, spindle and coolant. [task] The motors belong to the motion task, the rest to the controller
 * task. The charge pump is set up here (charge_pump.h). */
#ifndef WIFICNC_ESP32_OUTPUTS_H
#define WIFICNC_ESP32_OUTPUTS_H

#include "hal/pin_banks.h"
#include "io/pin_map.h"
#include "wires.h"

#include <stdbool.h>
#include <stdint.h>

struct hal_step;

enum switch_output {
    SWITCH_ENABLE,
    SWITCH_ENABLE_X, /* of one motor, as the others by their number */
    SWITCH_ENABLE_LAST = SWITCH_ENABLE_X + AXIS_COUNT - 1,
    SWITCH_SPINDLE_ENABLE,
    SWITCH_SPINDLE_DIR, /* on: counter-clockwise */
    SWITCH_SPINDLE_PWM,
    SWITCH_FLOOD,
    SWITCH_MIST,
    SWITCH_CHARGE_PUMP,
    SWITCH_SERVO,
    SWITCH_DIGITAL, /* P0 of M62 .. M65 */
    SWITCH_LAST_DIGITAL = SWITCH_DIGITAL + 4,
    SWITCH_COUNT
};

enum { OUTPUT_BANKS = PIN_BANKS + 1, SHIFTED_BANK = PIN_BANKS };

/** Levels of outputs that are switched off, ready for an interrupt; the last bank is the shift registers'. */
struct output_cut {
    uint32_t high[OUTPUT_BANKS], low[OUTPUT_BANKS];
};

struct outputs {
    struct output_wire wire[SWITCH_COUNT];
    struct output_cut drivers_off; /* with $4 the other way round */
    uint32_t *shifted;             /* outputs of shift registers, hal_step.shifted */
};

/** [start] Every output off, before anything else runs; also step and direction lines. */
void outputs_make_safe(const struct pin_map *map);

/** [task] @param wire  is copied @param shifted  hal_step.shifted @return false: a PWM channel could not be
 * set up */
bool outputs_init(struct outputs *outputs, const struct output_wire wire[SWITCH_COUNT], uint32_t *shifted);

/** Motor drivers on or off. @param invert  $4 */
void outputs_motors(const struct outputs *outputs, bool on, bool invert);

/** Is there a servo's output? */
bool outputs_have_servo(const struct outputs *outputs);

/** A pulse of this length every 20 ms, or none. Only with an output for it. @param pulse_us  0 .. 20000 */
void outputs_servo(uint16_t pulse_us);

/** Direction and enable. @param direction -1, 0, 1 */
void outputs_spindle(struct outputs *outputs, int direction);

/** Is there a PWM output of the spindle? */
bool outputs_have_pwm(const struct outputs *outputs);

/** @param bits  COOLANT_ of gcode/gcode.h */
void outputs_coolant(struct outputs *outputs, uint8_t bits);

/** @param bits  digital outputs of M62 .. M65, bit n = Pn */
void outputs_digital(const struct outputs *outputs, uint8_t bits);

/** [panic, or before a restart] All but the motor drivers off immediately, also those with a wave: the GPIO
 * matrix leads them back to their levels, which are off. Shift registers keep this state until the next
 * start. In IRAM. */
void outputs_cut(const struct outputs *outputs, struct hal_step *step);

/** Is there a charge pump's output? */
bool outputs_have_pump(const struct outputs *outputs);

#endif
