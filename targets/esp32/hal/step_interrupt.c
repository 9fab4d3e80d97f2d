/* SPDX-License-Identifier: MIT */
#include "hal/hal_step.h"
#include "hal/step_vector.h"

_Static_assert(__atomic_always_lock_free(sizeof(uint32_t), 0),
               "atomics are one instruction: a library's could not be called here");

/* A halted timer's last interrupt may still be on its way: it finds the step side not active. */
HAL_ISR void step_interrupt(struct step *step) {
    if (step->active)
        step_isr(step);
    else
        step_alarm_seen();
}
