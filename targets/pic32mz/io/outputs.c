/* SPDX-License-Identifier: MIT */
#include "io/outputs.h"

#include "gcode/gcode.h"
#include "hal/spindle_pwm.h"
#include "io/charge_pump.h"
#include "io/pin.h"

void outputs_make_safe(void) {
#define MAKE_SAFE(pin, signal, on_level) pin_make_output(pin, !(on_level));
    BOARD_OUTPUTS(MAKE_SAFE)
#undef MAKE_SAFE
}

static void set(const struct outputs *outputs, unsigned output, bool on) {
    const struct output_wire *wire = &outputs->wire[output];
    if (wire->pin != NO_PIN)
        pin_write(wire->pin, on == wire->active_high);
}

void outputs_init(struct outputs *outputs, const struct output_wire wire[SWITCH_COUNT]) {
    for (unsigned output = 0; output < SWITCH_COUNT; output++)
        outputs->wire[output] = wire[output];
    if (outputs->wire[SWITCH_SPINDLE_PWM].pin != NO_PIN)
        spindle_pwm_init(&outputs->wire[SWITCH_SPINDLE_PWM]);
    charge_pump_init(&outputs->wire[SWITCH_CHARGE_PUMP]);
}

void outputs_motors(const struct outputs *outputs, bool on, bool invert) {
    set(outputs, SWITCH_ENABLE, on != invert);
    for (unsigned motor = 0; motor < AXIS_COUNT; motor++)
        set(outputs, SWITCH_ENABLE_MOTOR + motor, on != invert);
    set(outputs, SWITCH_LED, on);
}

/* Direction first, so that the spindle never starts the wrong way round. */
void outputs_spindle(const struct outputs *outputs, int direction) {
    set(outputs, SWITCH_SPINDLE_DIR, direction < 0);
    set(outputs, SWITCH_SPINDLE_ENABLE, direction != 0);
}

bool outputs_have_pwm(const struct outputs *outputs) {
    return outputs->wire[SWITCH_SPINDLE_PWM].pin != NO_PIN;
}

void outputs_coolant(const struct outputs *outputs, uint8_t bits) {
    set(outputs, SWITCH_FLOOD, (bits & COOLANT_FLOOD) != 0);
    set(outputs, SWITCH_MIST, (bits & COOLANT_MIST) != 0);
}

void outputs_digital(const struct outputs *outputs, uint8_t bits) {
    for (unsigned output = SWITCH_DIGITAL; output <= SWITCH_LAST_DIGITAL; output++)
        set(outputs, output, (bits >> (output - SWITCH_DIGITAL) & 1) != 0);
}
