/* SPDX-License-Identifier: MIT
 * Step pulses, directions and slow outputs through shift registers, on a chip whose I2S peripheral takes no
 * words of the processor: a word begins the pulses, another one ends them, each a transfer of GP-SPI2. As
 * with pins the interrupt waits for what is left of a pulse, which is never shorter than a word
 * (BOARD_STEP_PULSE_NS), so a transfer has ended before the next one is due. Of hal_step.h. */
#ifndef WIFICNC_PULSE_SPI_H
#define WIFICNC_PULSE_SPI_H

#include "hal/spi_words.h"

/* Prep leaves time enough between events. The wait is for an interrupt that came late after one in time. */
static HAL_INLINE void step_spi_wait(uint32_t from, uint32_t cycles) {
    while (esp_cpu_get_cycle_count() - from < cycles) {
    }
}

/* All outputs without a pulse. @param quiet  no word begins before that many cycles have passed */
static HAL_INLINE void step_spi_rest(struct hal_step *hal, uint32_t quiet) {
    const uint32_t rest = step_shift_rest(hal);
    hal->quiet_at = step_spi_put(rest);
    hal->quiet = quiet;
    hal->shift_shown = rest;
}

/* An event without steps has a word only if a task has changed an output. */
static HAL_INLINE void hal_step_set(struct hal_step *hal, axis_mask_t axes) {
    const uint32_t rest = step_shift_rest(hal), steps = hal->pins.step[axes].bank[0];
    const bool any = steps != 0 || rest != hal->shift_shown;
    step_spi_wait(hal->quiet_at, hal->quiet);
    if (any)
        hal->set_at = step_spi_put(rest ^ steps);
    step_alarm_seen();
    hal->axes = any;
}

/* The pulse has been high while the ISR computed; only what is left of it is waited for. */
static HAL_INLINE void hal_step_clear(struct hal_step *hal) {
    if (hal->axes == 0)
        return;
    step_spi_wait(hal->set_at, hal->pulse_cycles);
    step_spi_rest(hal, hal->pulse_cycles);
}

/* hal_step_clear() came before, and its word is still leaving. Only when a direction changes. */
static HAL_INLINE void step_direction_put(struct hal_step *hal, axis_mask_t negative) {
    hal->shift_lines = hal->pins.dir[negative].bank[0] ^ hal->shift_inverted;
    step_spi_wait(hal->quiet_at, hal->quiet);
    step_spi_rest(hal, hal->dir_quiet_cycles);
}

#endif
