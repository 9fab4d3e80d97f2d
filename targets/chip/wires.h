/* SPDX-License-Identifier: MIT
 * What is wired to a chip's pins: numbers of the inputs, and how the levels of a word of inputs become
 * switches of axes. [any context] */
#ifndef WIFICNC_CHIP_WIRES_H
#define WIFICNC_CHIP_WIRES_H

#include "base/axis.h"
#include "gang.h"
#include "gcode/gcode.h" // DIGITAL_INPUT_COUNT
#include "hal/compiler.h"
#include "hal/hal.h"
#include "step_pins.h" // NO_PIN

#include <stdbool.h>
#include <stdint.h>

/** Inputs by number, which is their bit in a word; the motors of a kind follow one another (gang.h). */
enum {
    INPUT_LIMIT_MIN = 0,
    INPUT_LIMIT_MAX = INPUT_LIMIT_MIN + AXIS_COUNT,
    INPUT_HOME = INPUT_LIMIT_MAX + AXIS_COUNT,
    INPUT_PROBE = INPUT_HOME + AXIS_COUNT,
    INPUT_TOOLSETTER,
    INPUT_ESTOP,
    INPUT_MISC, /* P0 of M66 */
    INPUT_COUNT = INPUT_MISC + DIGITAL_INPUT_COUNT
};
_Static_assert((int)INPUT_COUNT <= 32, "an input is a bit of a word");

#define INPUT_AXES     ((1u << AXIS_COUNT) - 1)
#define INPUT_LIMITS   (INPUT_AXES << INPUT_LIMIT_MIN | INPUT_AXES << INPUT_LIMIT_MAX)
#define INPUT_HOMES    (INPUT_AXES << INPUT_HOME)
#define INPUT_SWITCHES (INPUT_LIMITS | INPUT_HOMES)
#define INPUT_STOPPING (INPUT_SWITCHES | 1u << INPUT_ESTOP) /* their edges interrupt */

/** A pin and what it needs; what active_high means for limits, probe and tool setter, whose settings are $5,
 * $6 and $72, is the target's. */
struct input_wire {
    uint8_t pin; /* NO_PIN: not wired */
    bool active_high;
    uint8_t pull; /* PIN_PULL_ of pin_config.h */
};

/** Which level of inputs counts, by settings: $5, $6, $72, $749. */
struct input_senses {
    bool limit_invert, probe_invert, toolsetter_invert, estop_normally_open;
};

/** A pin and the level that switches it on. */
struct output_wire {
    uint8_t pin; /* NO_PIN: not wired */
    bool active_high;
};

/** Levels of inputs, bit n = input n. The core looks at the axes that there are. */
static HAL_INLINE struct hal_switches switches_of(const struct gang *gang, uint32_t levels) {
    return (struct hal_switches){
        .limit_min = (axis_mask_t)(levels >> INPUT_LIMIT_MIN & INPUT_AXES),
        .limit_max = (axis_mask_t)(levels >> INPUT_LIMIT_MAX & INPUT_AXES),
        .second_min = gang_seconds(gang, levels >> INPUT_LIMIT_MIN),
        .second_max = gang_seconds(gang, levels >> INPUT_LIMIT_MAX),
        .home = (axis_mask_t)(levels >> INPUT_HOME & INPUT_AXES),
        .second_home = gang_seconds(gang, levels >> INPUT_HOME),
    };
}

#endif
