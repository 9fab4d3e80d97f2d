/* SPDX-License-Identifier: MIT
 * The interrupts of timer 4 and OC1: prepared once, then they call step_isr() of the one machine. */
#ifndef WIFICNC_PIC32MZ_STEP_ENGINE_H
#define WIFICNC_PIC32MZ_STEP_ENGINE_H

#include "hal/hal_step.h"
#include "step/isr.h"

/** What the board fixes. */
struct step_engine_board {
    struct gang gang;
    uint8_t step_pin[AXIS_COUNT], dir_pin[AXIS_COUNT]; /* of the motors; NO_PIN: no such motor */
    uint8_t step_low, dir_low;                         /* motors whose lines the board calls active low */
    uint32_t step_pulse_ns, dir_setup_ns;
};

/** [start] Tables and timer; nothing runs yet. @param board  outlives this @return false: a pin is
 * impossible */
bool step_engine_init(struct hal_step *hal, const struct step_engine_board *board);

/** [start, interrupts off] From now on the timer's interrupts move this. */
void step_engine_attach(struct step *step);

/** [task, while the interrupt looks at no probe] hal_step_probe() is true while this pin has this level;
 * NO_PIN: never. */
void step_engine_watch(struct hal_step *hal, uint8_t pin, bool high);

/** [task, at rest] Length of a step pulse, and of the pause behind it. */
void step_engine_set_pulse(struct hal_step *hal, uint32_t step_pulse_ns);

/** [task, at rest] Lines that are the other way round than the board says, bit n = axis n: they take their
 * levels of rest.
 * @param second  axes whose second motor turns the other way round than the first one */
void step_engine_invert(struct hal_step *hal, axis_mask_t step, axis_mask_t dir, axis_mask_t second);

/** [start] board->gang has changed: the tables again. */
void step_engine_regroup(struct hal_step *hal);

/** [task, at rest, but for the end of the last pulse] hal_ganged.hold. */
void step_engine_hold(struct hal_step *hal, axis_mask_t first, axis_mask_t second);

/** From startup.S. [isr] */
void on_step_timer(void);
void on_pulse_end(void);

#endif
