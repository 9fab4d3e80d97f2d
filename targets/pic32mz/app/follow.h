/* SPDX-License-Identifier: MIT
 * Lets pins and pulses follow the settings that are the hardware's business ($0 .. $6), and the motors follow
 * the motion ($1). [task] */
#ifndef WIFICNC_PIC32MZ_FOLLOW_H
#define WIFICNC_PIC32MZ_FOLLOW_H

#include "hal/pic32mz_hal.h"
#include "machine/machine.h"

struct follow {
    struct machine *machine;
    struct hal *hal;
    struct settings applied; /* what the hardware does now */
    bool motors_on;
    uint32_t switched_us; /* when the motors went on */
    uint32_t rested_us;   /* since when nothing moves */
};

/** [start, before anything moves] Bring the hardware to what is stored; the motors are off. */
void follow_init(struct follow *follow, struct machine *machine, struct hal *hal);

/** Apply what has changed, as soon as nothing moves; motors on before the first step, off $1 after the last.
 *  @return false: the drivers are waking, nothing may move yet */
bool follow_poll(struct follow *follow);

#endif
