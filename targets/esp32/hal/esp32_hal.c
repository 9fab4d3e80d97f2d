/* SPDX-License-Identifier: MIT
 * Of the cold tier of the HAL (core/hal/hal.h) what is this chip's own; the rest is in targets/chip. */
#include "hal/chip_hal.h"

#include "hal/hal.h"

#include "esp_timer.h"

uint32_t hal_time_us(const struct hal *hal) {
    (void)hal;
    return (uint32_t)esp_timer_get_time();
}

void hal_probe_watch(struct hal *hal, bool high) {
    if (hal->step.probe_mask != 0)
        hal->step.probe_level = high ? hal->step.probe_mask : 0;
}

static void read_encoder(struct hal *hal, struct hal_encoder_state *out) {
    encoder_read(&hal->encoder, hal_time_us(hal), out);
}

static void set_servo(struct hal *hal, uint16_t pulse_us) {
    (void)hal;
    outputs_servo(pulse_us);
}

const struct hal_servo esp32_servo = {.set = set_servo};
const struct hal_encoder esp32_encoder = {.has_index = false, .read = read_encoder};
const struct hal_encoder esp32_indexed_encoder = {.has_index = true, .read = read_encoder};
