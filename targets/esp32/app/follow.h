/* SPDX-License-Identifier: MIT
 * Lets pins and pulses follow the settings that are the hardware's business ($0, $2 .. $6). [task of
 * machine_poll()]
 */
#ifndef WIFICNC_ESP32_FOLLOW_H
#define WIFICNC_ESP32_FOLLOW_H

#include "hal/chip_hal.h"
#include "hal/step_engine.h"
#include "machine/machine.h"
#include "settings/settings.h"

struct follow {
    struct machine *machine;
    struct hal *hal;
    struct settings applied; /* what the hardware does now */
};

/** [start, before anything moves] Bring the hardware to what is stored. */
void follow_init(struct follow *follow, struct machine *machine, struct hal *hal);

/** Apply what has changed, as soon as nothing moves. */
void follow_poll(struct follow *follow);

#endif
