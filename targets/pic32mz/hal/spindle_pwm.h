/* SPDX-License-Identifier: MIT
 * The spindle's PWM: OC8 on timer 6. OC8RS counts from the next period on, so a store at any moment makes no
 * false pulse; 0 is never high, and one beyond the last count always. */
#ifndef WIFICNC_PIC32MZ_SPINDLE_PWM_H
#define WIFICNC_PIC32MZ_SPINDLE_PWM_H

#include "base/duty.h"
#include "chip/sfr.h"
#include "hal/compiler.h"

#include <stdint.h>

struct output_wire;

/** [start] Dark at first. */
void spindle_pwm_init(const struct output_wire *wire);

/** [task] From now on so many periods a second; a change leaves it dark.
 * @return no pulse, one count, always on */
struct duty_register spindle_pwm_tune(uint32_t hz);

/** [task or isr] */
static HAL_INLINE void spindle_pwm_set(uint32_t ticks) {
    OC8RS = ticks;
}

/** [NMI] The pin is the port's, as outputs_make_safe() has set it. Until the next reset. */
void spindle_pwm_release(void);

#endif
