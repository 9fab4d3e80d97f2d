/* SPDX-License-Identifier: MIT
 * Shift registers behind the I2S peripheral, where the board chose that engine (hal/pulse_i2s.h). */
#ifndef WIFICNC_ESP32_STEP_I2S_H
#define WIFICNC_ESP32_STEP_I2S_H

#include "hal/step_engine.h"

/** A pin's number that is an output of a shift register, and its bit in a word. */
static inline bool step_i2s_has(uint8_t pin) {
    return pin >= BOARD_I2SO_FIRST && pin != NO_PIN;
}
static inline uint32_t step_i2s_bit(uint8_t pin) {
    return 1u << (pin - BOARD_I2SO_FIRST);
}

/** [start, before anything else] Registers come up with any levels: from now on they show this word. The pins
 * are shifted by hand. */
void step_i2s_shift_out(uint32_t word);

/** [start] The tables of the motors' lines. @return false: one of them is no output of a register */
bool step_i2s_group(struct hal_step *hal, const struct step_engine_board *board);

/** [start] The peripheral begins, with the word that the registers show. @return false: a step or direction
 * line is no output of a register */
bool step_i2s_init(struct hal_step *hal, const struct step_engine_board *board);

/** [motion task, no step interrupt comes] The other outputs as tasks have set them. */
void step_i2s_show(struct hal_step *hal);

/** [e-stop's interrupt, motion is halted] These outputs of the registers become high and low: behind the
 * words that wait in the FIFO. */
void step_i2s_cut(struct hal_step *hal, uint32_t high, uint32_t low);

/** [task] The FIFO was full since it was asked last, so a word may have been lost. */
bool step_i2s_has_lost(void);

/** [task, at rest] Length of the pulses and of the pauses. @param ns  whole words, up to 16 */
void step_i2s_set_pulse(struct hal_step *hal, uint32_t ns);

/** [task, at rest] Motors whose step and direction lines are active low, bit n = motor n. */
void step_i2s_invert(struct hal_step *hal, unsigned steps, unsigned dirs);

/** [task, at rest] hal_ganged.hold. */
void step_i2s_hold(struct hal_step *hal, axis_mask_t first, axis_mask_t second);

#endif
