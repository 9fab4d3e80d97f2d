/* SPDX-License-Identifier: MIT
 * Lets pins and pulses follow the settings that are the hardware's business ($0, $2 .. $6, $72, $749). [task
 * of machine_poll()]
 */
#ifndef WIFICNC_ESP32_FOLLOW_H
#define WIFICNC_ESP32_FOLLOW_H

#include "hal/chip_hal.h"
#include "hal/step_engine.h"
#include "machine/machine.h"

/** What of the settings the hardware does. Comparable by memcmp(): no padding. */
struct follow_signals {
    uint16_t pulse_us;
    uint8_t step_invert, dir_invert, second_dir_invert;
    uint8_t reserved; /* 0 */
    struct input_senses senses;
};

struct follow {
    struct machine *machine;
    struct hal *hal;
    struct follow_signals applied; /* now */
};

/** [start, before anything moves] Bring the hardware to what is stored. */
void follow_init(struct follow *follow, struct machine *machine, struct hal *hal);

/** Apply what has changed, as soon as nothing moves. */
void follow_poll(struct follow *follow);

#endif
