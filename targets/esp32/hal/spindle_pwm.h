/* SPDX-License-Identifier: MIT
 * The spindle's PWM: timer, operator and comparator 0 of MCPWM group 0.
 *
 *   count     0 ........ compare ........... last | 0 ........ compare ....
 *   output    low        ^ high              ^ low
 *
 * A new compare value counts from the next period on, so a store at any moment makes no false pulse. One
 * beyond the last count is never reached: dark for certain, whatever the chip does first where two events
 * meet. */
#ifndef WIFICNC_ESP32_SPINDLE_PWM_H
#define WIFICNC_ESP32_SPINDLE_PWM_H

#include "soc/mcpwm_struct.h"

#include <stdbool.h>
#include <stdint.h>

struct output_wire;

#define SPINDLE_PWM_HZ       5000u /* analogue converters of spindle drives filter it well */
#define SPINDLE_PWM_CLOCK_HZ 80000000u
#define SPINDLE_PWM_PERIOD   (SPINDLE_PWM_CLOCK_HZ / SPINDLE_PWM_HZ)

/** struct duty_register: no pulse, one count, all but one. */
#define SPINDLE_PWM_DARK     (SPINDLE_PWM_PERIOD + 1u)
#define SPINDLE_PWM_REGISTER {SPINDLE_PWM_DARK, SPINDLE_PWM_PERIOD - 2u, 0}

_Static_assert(SPINDLE_PWM_DARK <= 65535u, "the comparator has 16 bits");

/** [task] Dark at first. @return false: the driver refuses */
bool spindle_pwm_init(const struct output_wire *wire);

/** [task or isr] */
static inline __attribute__((always_inline)) void spindle_pwm_set(uint32_t compare) {
    MCPWM0.operators[0].timestamp[0].val = compare;
}

#endif
