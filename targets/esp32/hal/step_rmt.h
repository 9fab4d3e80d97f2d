/* SPDX-License-Identifier: MIT
 * RMT channels for the step lines, where the board chose that engine (hal/pulse_rmt.h). ESP-IDF's driver
 * gives them, so that no one else gets them; afterwards only the interrupt touches them. */
#ifndef WIFICNC_ESP32_STEP_RMT_H
#define WIFICNC_ESP32_STEP_RMT_H

#include "hal/hal_step.h"

/** [start, before anyone else wants a channel] Axis n gets channel n. @return false: an axis has no step
 * pin, or the driver gave something else */
bool step_rmt_init(struct hal_step *hal, const uint8_t step_gpio[AXIS_COUNT]);

/** [task, at rest] Length of the pulses. @param ns  500 .. 255000 */
void step_rmt_set_pulse(struct hal_step *hal, uint32_t ns);

#endif
