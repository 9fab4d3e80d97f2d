/* SPDX-License-Identifier: MIT
 * Shift registers, where the board chose that engine: behind the I2S peripheral (hal/pulse_i2s.h), or behind
 * the SPI on a chip whose I2S takes no words of the processor (hal/pulse_spi.h). */
#ifndef WIFICNC_ESP32_STEP_SHIFT_H
#define WIFICNC_ESP32_STEP_SHIFT_H

#include "hal/step_engine.h"

/** The SPI sends the bytes of a word in the other order: the last output first, as the registers need it. */
#define STEP_SHIFT_ORDER (BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_SPI ? 24u : 0u)

/** A pin's number that is an output of a shift register, and its bit in a word. */
static inline bool step_shift_has(uint8_t pin) {
    return pin >= BOARD_I2SO_FIRST && pin != NO_PIN;
}
static inline uint32_t step_shift_bit(uint8_t pin) {
    return 1u << ((pin - BOARD_I2SO_FIRST) ^ STEP_SHIFT_ORDER);
}

/** [start, before anything else] Registers come up with any levels: from now on they show this word. The pins
 * are shifted by hand. */
void step_shift_out(uint32_t word);

/** [start] The tables of the motors' lines. @return false: one of them is no output of a register */
bool step_shift_group(struct hal_step *hal, const struct step_engine_board *board);

/** [start] The peripheral begins, with the word that the registers show. @return false: a step or direction
 * line is no output of a register */
bool step_shift_init(struct hal_step *hal, const struct step_engine_board *board);

/** [motion task, no step interrupt comes] The other outputs as tasks have set them. */
void step_shift_show(struct hal_step *hal);

/** [e-stop's interrupt, motion is halted] These outputs of the registers become high and low: after
 * the words that are under way. */
void step_shift_cut(struct hal_step *hal, uint32_t high, uint32_t low);

/** [panic, or before a restart] The registers show what step_shift_cut() has put, until the next start: the
 * latch is taken off the peripheral. Takes 136 us. */
void step_shift_freeze(struct hal_step *hal);

/** [task] A word found no room since it was asked last, so pulses may have been lost. */
bool step_shift_has_lost(void);

/** [task, at rest] Length of the pulses and of the pauses in the FIFO. @param ns  whole words, up to 16 */
void step_shift_set_pulse(struct hal_step *hal, uint32_t ns);

/** [task, at rest] Motors whose step and direction lines are active low, bit n = motor n. */
void step_shift_invert(struct hal_step *hal, unsigned steps, unsigned dirs);

/** [task, at rest] hal_ganged.hold. */
void step_shift_hold(struct hal_step *hal, axis_mask_t first, axis_mask_t second);

#endif
