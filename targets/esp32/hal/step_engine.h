/* SPDX-License-Identifier: MIT
 * The step timer's interrupt: prepared once, then it calls step_isr() of one machine (hal/step_vector.S).
 * Core 1. */
#ifndef WIFICNC_ESP32_STEP_ENGINE_H
#define WIFICNC_ESP32_STEP_ENGINE_H

#include "hal/hal_step.h"
#include "step/isr.h"

/** What the board fixes. */
struct step_engine_board {
    struct gang gang;
    uint8_t step_gpio[AXIS_COUNT], dir_gpio[AXIS_COUNT]; /* of the motors; NO_PIN: no such motor */
    uint8_t step_low, dir_low;                           /* motors whose lines the board calls active low */
    uint32_t timer_hz;                                   /* APB clock (80 MHz) divided by 2 .. 65536 */
    uint32_t step_pulse_ns, dir_setup_ns;
};

/** [start] Tables, timer, and RMT channels or I2S where the board wants them: before the LED takes
 * one. Nothing runs yet. @param board  outlives this
 * @return false: a pin, the clock or a channel is impossible */
bool step_engine_init(struct hal_step *hal, const struct step_engine_board *board);

/** [task, at rest] Length of a step pulse, and of the pause behind it. */
void step_engine_set_pulse(struct hal_step *hal, uint32_t step_pulse_ns);

/** [task, at rest] Lines that are the other way round than the board says, bit n = axis n: the GPIO matrix
 * inverts them, or the words of shift registers have them inverted.
 * @param second  axes whose second motor turns the other way round than the first one */
void step_engine_invert(struct hal_step *hal, axis_mask_t step, axis_mask_t dir, axis_mask_t second);

/** [start] board->gang has changed: the tables again. */
void step_engine_regroup(struct hal_step *hal);

/** [task, at rest, but for the end of the last pulse] hal_ganged.hold. */
void step_engine_hold(struct hal_step *hal, axis_mask_t first, axis_mask_t second);

/** [motion task, each round] Shift registers show what tasks have changed of their outputs. While steps are
 * made, the step interrupt does so. */
void step_engine_show(const struct step *step);

/** [e-stop's interrupt, motion is halted] These outputs of shift registers become high and low. */
void step_engine_cut(struct hal_step *hal, uint32_t high, uint32_t low);

/** [panic, or before a restart] Shift registers keep what step_engine_cut() has put until the next start. */
void step_engine_freeze(struct hal_step *hal);

/** [task] A word for the shift registers found no room: pulses may be missing. Once for each such fault. */
bool step_engine_has_lost(void);

/** [task on core 1] Route the timer's interrupt, of level 5, to `step`. @return false: no interrupt is free
 */
bool step_engine_attach(struct step *step);

/** [task, while the interrupt looks at no probe] hal_step_probe() is true while this pin has this level;
 * NO_PIN: never. */
void step_engine_watch(struct hal_step *hal, uint8_t gpio, bool high);

#endif
