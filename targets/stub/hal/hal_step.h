/* SPDX-License-Identifier: MIT
 * Hot tier of a target that has no hardware yet: a place to start from. The comments name what a real
 * chip does there. Contract: core/hal/README.md. */
#ifndef WIFICNC_HAL_STEP_H
#define WIFICNC_HAL_STEP_H

#include "base/axis.h"
#include "hal/compiler.h"

#include <stdbool.h>
#include <stdint.h>

#define HAL_ISR /* the section that the step ISR must run from, where the chip has one */

/** Step timer and pins. */
struct hal_step {
    axis_mask_t high;     /* step lines that are active */
    axis_mask_t negative; /* direction lines */
    uint32_t ticks;       /* to the next event */
    uint32_t duty;        /* of the PWM output while it is a laser's */
    bool running;         /* the timer: its interrupt calls step_isr() */
};

static HAL_INLINE void hal_step_set(struct hal_step *hal, axis_mask_t axes) {
    hal->high = axes; /* set the step pins */
}

static HAL_INLINE void hal_step_clear(struct hal_step *hal) {
    hal->high = 0; /* wait until the pulse is long enough, then clear the step pins */
}

static HAL_INLINE void hal_step_direction(struct hal_step *hal, axis_mask_t negative) {
    hal->negative = negative; /* set the direction pins */
}

static HAL_INLINE void hal_step_duty(struct hal_step *hal, uint32_t value) {
    hal->duty = value; /* one store into the register that the PWM takes at its next period */
}

static HAL_INLINE bool hal_step_probe(const struct hal_step *hal) {
    (void)hal; /* read the probe pin */
    return false;
}

static HAL_INLINE void hal_step_timer_start(struct hal_step *hal, uint32_t ticks) {
    hal->ticks = ticks; /* set the timer, enable its interrupt */
    hal->running = true;
}

static HAL_INLINE void hal_step_timer_next(struct hal_step *hal, uint32_t ticks) {
    hal->ticks = ticks; /* counted from the present event */
}

static HAL_INLINE void hal_step_timer_stop(struct hal_step *hal) {
    hal->running = false;
}

static HAL_INLINE void hal_step_span(struct hal_step *hal, uint16_t flags, uint32_t line) {
    (void)hal;
    (void)flags;
    (void)line; /* for traces only */
}

#endif
