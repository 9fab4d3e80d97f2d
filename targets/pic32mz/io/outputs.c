/* SPDX-License-Identifier: MIT */
#include "io/outputs.h"

#include "chip/clock.h"
#include "gcode/gcode.h"
#include "hal/spindle_pwm.h"
#include "io/pin.h"

#define RPE3_IS_OC8 12u /* Table 12-22 */
#define PIN_RE3     (16u * 4u + 3u)

_Static_assert(PIN_SPINDLE_PWM == PIN_NONE || PIN_SPINDLE_PWM == PIN_RE3, "OC8 is routed to RE3 here");

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

static void start_pwm(const struct output_wire *wire) {
    T6CON = 0;
    PR6 = SPINDLE_PWM_PERIOD - 1;
    OC8R = SPINDLE_PWM_ACTIVE_HIGH ? 0 : SPINDLE_PWM_PERIOD;
    spindle_pwm_set(SPINDLE_PWM_OF(0u));
    OC8CON = OCM_PWM | OCCON_ON;
    T6CON = TCON_ON;
    /* Last: until then the port keeps the pin at its safe level. */
    RPR(wire->pin) = RPE3_IS_OC8;
}

void outputs_init(struct outputs *outputs, const struct output_wire wire[SWITCH_COUNT]) {
    for (unsigned output = 0; output < SWITCH_COUNT; output++)
        outputs->wire[output] = wire[output];
    outputs->pump_level = false;
    if (outputs->wire[SWITCH_SPINDLE_PWM].pin != NO_PIN)
        start_pwm(&outputs->wire[SWITCH_SPINDLE_PWM]);
}

void outputs_motors(const struct outputs *outputs, bool on, bool invert) {
    set(outputs, SWITCH_ENABLE, on != invert);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        set(outputs, SWITCH_ENABLE_AXIS + ax, on != invert);
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

void outputs_pump(struct outputs *outputs) {
    outputs->pump_level = !outputs->pump_level;
    set(outputs, SWITCH_CHARGE_PUMP, outputs->pump_level);
}
