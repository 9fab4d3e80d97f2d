/* SPDX-License-Identifier: MIT
 * Direction lines by the GPIO registers. Of hal_step.h. */
#ifndef WIFICNC_DIRECTION_GPIO_H
#define WIFICNC_DIRECTION_GPIO_H

static HAL_INLINE void step_direction_put(struct hal_step *hal, axis_mask_t negative) {
    const struct pin_bits *set = &hal->pins.dir[negative];
    const struct pin_bits *clear = &hal->pins.dir[~negative & (AXIS_MASKS - 1)];
    step_pulse_wait(hal);
    GPIO.out_w1ts = set->bank[0];
    GPIO.out1_w1ts.val = set->bank[1];
    GPIO.out_w1tc = clear->bank[0];
    GPIO.out1_w1tc.val = clear->bank[1];
    step_direction_done(hal);
}

#endif
