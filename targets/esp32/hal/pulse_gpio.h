/* SPDX-License-Identifier: MIT
 * Step pulses by the GPIO registers: the interrupt begins and ends them. All axes together. Of hal_step.h. */
#ifndef WIFICNC_PULSE_GPIO_H
#define WIFICNC_PULSE_GPIO_H

/* Prep leaves time enough between events. The wait is for an interrupt that came late after one in time.
 * Times are those of the cycle counter before a register is written: the way to the pins is as long for both
 * edges. */
static HAL_INLINE void hal_step_set(struct hal_step *hal, axis_mask_t axes) {
    const struct pin_bits *bits = &hal->pins.step[axes];
    uint32_t now;
    do
        now = esp_cpu_get_cycle_count();
    while (now - hal->quiet_at < hal->quiet);
    GPIO.out_w1ts = bits->bank[0];
    GPIO.out1_w1ts.val = bits->bank[1];
    step_alarm_seen();
    hal->set_at = now;
    hal->axes = axes;
}

/* The pulse has been high while the ISR computed; only what is left of it is waited for. */
static HAL_INLINE void hal_step_clear(struct hal_step *hal) {
    if (hal->axes == 0)
        return;
    const struct pin_bits *bits = &hal->step_lines;
    uint32_t now;
    do
        now = esp_cpu_get_cycle_count();
    while (now - hal->set_at < hal->pulse_cycles);
    GPIO.out_w1tc = bits->bank[0];
    GPIO.out1_w1tc.val = bits->bank[1];
    hal->quiet_at = now;
    hal->quiet = hal->pulse_cycles;
}

/* hal_step_clear() came before. */
static HAL_INLINE void step_pulse_wait(const struct hal_step *hal) {
    (void)hal;
}

static HAL_INLINE void step_direction_done(struct hal_step *hal) {
    hal->quiet_at = esp_cpu_get_cycle_count();
    hal->quiet = hal->dir_quiet_cycles;
}

#endif
