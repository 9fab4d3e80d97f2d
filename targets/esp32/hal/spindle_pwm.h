/* SPDX-License-Identifier: MIT
 * The spindle's PWM: timer, operator and comparator 0 of MCPWM group 0.
 *
 *   count     0 ........ compare ........... last | 0 ........ compare ....
 *   output    low        ^ high              ^ low
 *
 * A new compare value counts from the next period on, so a store at any moment makes no false pulse. One
 * beyond the last count is never reached: dark for certain, whatever the chip does first where two events
 * meet, and at every frequency. */
#ifndef WIFICNC_ESP32_SPINDLE_PWM_H
#define WIFICNC_ESP32_SPINDLE_PWM_H

#include "base/duty.h"
#include "pwm_period.h"

#include "soc/mcpwm_struct.h"

#include <stdbool.h>
#include <stdint.h>

struct output_wire;

#define SPINDLE_PWM_CLOCK_HZ 80000000u

/** [task] Dark at first. @return false: the driver refuses */
bool spindle_pwm_init(const struct output_wire *wire);

/** [task] From now on so many periods a second. A change takes one old period and leaves it dark.
 * @return no pulse, one count, all but one */
struct duty_register spindle_pwm_tune(uint32_t hz);

/** [task or isr] */
static inline __attribute__((always_inline)) void spindle_pwm_set(uint32_t compare) {
    MCPWM0.operators[0].timestamp[0].val = compare;
}

#endif
