/* SPDX-License-Identifier: MIT
 * The spindle's PWM: OC8 on timer 6. OC8RS counts from the next period on, so a store at any moment makes no
 * false pulse; 0 is never high, SPINDLE_PWM_PERIOD always. */
#ifndef WIFICNC_PIC32MZ_SPINDLE_PWM_H
#define WIFICNC_PIC32MZ_SPINDLE_PWM_H

#include "chip/clock.h"
#include "chip/sfr.h"
#include "hal/compiler.h"
#include "pin_config.h"

#include <stdint.h>

#define SPINDLE_PWM_HZ     5000u /* analogue converters of spindle drives filter it well */
#define SPINDLE_PWM_PERIOD (CLOCK_BUS_HZ / SPINDLE_PWM_HZ)

/** struct duty_register: OC8RS is where the pin goes low, and so high where it is active low. */
#define SPINDLE_PWM_OF(on)   (SPINDLE_PWM_ACTIVE_HIGH ? (on) : SPINDLE_PWM_PERIOD - (on))
#define SPINDLE_PWM_REGISTER {SPINDLE_PWM_OF(0u), SPINDLE_PWM_OF(1u), SPINDLE_PWM_OF(SPINDLE_PWM_PERIOD)}

_Static_assert(SPINDLE_PWM_PERIOD <= 65535u, "timer 6 has 16 bits");

#define SPINDLE_PWM_LEVEL(pin, signal, on_level) +((pin) == PIN_SPINDLE_PWM && (on_level))
#define SPINDLE_PWM_ACTIVE_HIGH                  ((0 BOARD_OUTPUTS(SPINDLE_PWM_LEVEL)) != 0)

/** [task or isr] */
static HAL_INLINE void spindle_pwm_set(uint32_t ticks) {
    OC8RS = ticks;
}

#endif
