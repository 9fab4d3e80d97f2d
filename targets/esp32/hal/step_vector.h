/* SPDX-License-Identifier: MIT
 * The step timer's interrupt between the processor's vector (step_vector.S) and the step ISR. */
#ifndef WIFICNC_ESP32_STEP_VECTOR_H
#define WIFICNC_ESP32_STEP_VECTOR_H

#include "step/isr.h"

/** What the vector gives to step_interrupt(): set before the interrupt is enabled. */
extern struct step *step_vector_argument;

/** [step_vector.S alone] An alarm of the step timer. Of the call0 ABI: other code cannot call it. */
void step_interrupt(struct step *step);

#endif
