/* SPDX-License-Identifier: MIT
 * The motion side: one task on core 1, where also the interrupts of step timer and inputs live. Nothing there
 * allocates, logs or touches the network. */
#ifndef WIFICNC_ESP32_MOTION_TASK_H
#define WIFICNC_ESP32_MOTION_TASK_H

#include "hal/chip_hal.h"
#include "machine/machine.h"

#include <stdbool.h>

/** For machine_board.motion_side; its context is NULL: a chip has one motion side. */
extern const struct hal_motion_side motion_task_side;

/** [start, core 0] Start it and wait until its interrupts are attached. @return false: memory or interrupts
 * ran out */
bool motion_task_start(struct machine *machine, struct hal *hal);

/** [task] Look now: something has been planned. */
void motion_task_wake(void);

#endif
