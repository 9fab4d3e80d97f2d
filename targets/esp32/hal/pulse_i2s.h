/* SPDX-License-Identifier: MIT
 * Step pulses, directions and slow outputs through shift registers: the interrupt writes the words of a pulse
 * and of its pause into the I2S peripheral's FIFO, which sends one each BOARD_STEP_GRID_NS and repeats the
 * last. Nothing waits; pulse, pause and direction set-up are as many words, whatever happens to the processor
 * between them. Of hal_step.h.
 *
 * An event's words have left before the next event (BOARD_STEP_GRID_NS in core/machine/configure.c), unless
 * its interrupt came late: then they follow those of the one before. Only core 1 writes: the step interrupt,
 * and the motion task while no step interrupt comes (step_engine_show()). */
#ifndef WIFICNC_PULSE_I2S_H
#define WIFICNC_PULSE_I2S_H

#include "hal/i2s_words.h"

static HAL_INLINE void hal_step_set(struct hal_step *hal, axis_mask_t axes) {
    const uint32_t rest = step_shift_rest(hal), words = hal->i2s_pulse_words;
    step_i2s_put(rest ^ hal->pins.step[axes].bank[0], words);
    step_i2s_put(rest, words);
    hal->shift_shown = rest;
    step_alarm_seen();
}

static HAL_INLINE void hal_step_clear(struct hal_step *hal) {
    (void)hal;
}

/* Behind the pause of the pulse before. */
static HAL_INLINE void step_direction_put(struct hal_step *hal, axis_mask_t negative) {
    hal->shift_lines = hal->pins.dir[negative].bank[0] ^ hal->shift_inverted;
    const uint32_t rest = step_shift_rest(hal);
    step_i2s_put(rest, hal->i2s_setup_words);
    hal->shift_shown = rest;
}

#endif
