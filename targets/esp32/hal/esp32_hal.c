/* SPDX-License-Identifier: MIT
 * Of the cold tier of the HAL (core/hal/hal.h) what is this chip's own; the rest is in targets/chip. */
#include "hal/chip_hal.h"

#include "hal/hal.h"
#include "hal/step_engine.h"
#include "io/charge_pump.h"
#include "io/output_cut.h"
#include "pin_config.h"

#include "esp_timer.h"

uint32_t hal_time_us(const struct hal *hal) {
    (void)hal;
    return (uint32_t)esp_timer_get_time();
}

void hal_probe_watch(struct hal *hal, enum hal_probe probe, bool high) {
    step_engine_watch(&hal->step,
                      hal->inputs.wire[probe == HAL_TOOLSETTER ? INPUT_TOOLSETTER : INPUT_PROBE].pin, high);
}

HAL_ISR void hal_estop(struct hal *hal, bool invert, uint16_t dark) {
    const struct output_cut *drivers = &hal->outputs.drivers_off;
    const struct output_wire *spindle = &hal->outputs.wire[SWITCH_SPINDLE_ENABLE];
    struct output_cut cut;
    for (unsigned bank = 0; bank < OUTPUT_BANKS; bank++) {
        cut.high[bank] = invert ? drivers->low[bank] : drivers->high[bank];
        cut.low[bank] = invert ? drivers->high[bank] : drivers->low[bank];
    }
    output_cut_add(&cut, spindle, !spindle->active_high);
    output_cut_pins(&cut);
    if (hal->outputs.wire[SWITCH_SPINDLE_PWM].pin != NO_PIN)
        hal_step_duty(&hal->step, dark);
    step_engine_cut(&hal->step, cut.high[SHIFTED_BANK], cut.low[SHIFTED_BANK]);
}

static void read_encoder(struct hal *hal, struct hal_encoder_state *out) {
    encoder_read(&hal->encoder, hal_time_us(hal), out);
}

static void set_servo(struct hal *hal, uint16_t pulse_us) {
    (void)hal;
    outputs_servo(pulse_us);
}

const struct hal_servo esp32_servo = {.set = set_servo};

static void set_pump(struct hal *hal, uint32_t ticks) {
    (void)hal;
    charge_pump_set(ticks);
}

const struct hal_pump esp32_pump = {.default_hz = BOARD_PUMP_DEFAULT_HZ,
                                    .clock_hz = BOARD_PUMP_CLOCK_HZ,
                                    .ticks_min = BOARD_PUMP_TICKS_MIN,
                                    .ticks_max = BOARD_PUMP_TICKS_MAX,
                                    .set = set_pump};
const struct hal_encoder esp32_encoder = {.has_index = false, .read = read_encoder};
const struct hal_encoder esp32_indexed_encoder = {.has_index = true, .read = read_encoder};
