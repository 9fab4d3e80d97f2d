/* SPDX-License-Identifier: MIT
 * $33 in counts of a 16-bit timer. Pure. */
#ifndef WIFICNC_CHIP_PWM_PERIOD_H
#define WIFICNC_CHIP_PWM_PERIOD_H

#include <stdint.h>

/** A compare value of this is never reached: dark at every frequency. */
#define PWM_NEVER 65535u

struct pwm_period {
    uint32_t shift;  /* the clock is divided by 2^shift */
    uint32_t counts; /* of the divided clock, below PWM_NEVER */
};

/** As many counts as fit. @param hz  $33 */
static inline struct pwm_period pwm_period_of(uint32_t clock_hz, uint32_t hz) {
    struct pwm_period period = {0, (clock_hz + hz / 2) / hz};
    while (period.counts >= PWM_NEVER) {
        period.shift++;
        period.counts = ((clock_hz >> period.shift) + hz / 2) / hz;
    }
    return period;
}

#endif
