/* SPDX-License-Identifier: MIT */
#include "hal/spindle_pwm.h"

#include "chip/clock.h"
#include "pin_config.h"
#include "pwm_period.h"
#include "wires.h"

#define START_HZ 5000u /* until $33 is there */

#define RPE3_IS_OC8 12u /* Table 12-22 */
#define PIN_RE3     (16u * 4u + 3u)

_Static_assert(PIN_SPINDLE_PWM == PIN_NONE || PIN_SPINDLE_PWM == PIN_RE3, "OC8 is routed to RE3 here");

#define LEVEL(pin, signal, on_level) +((pin) == PIN_SPINDLE_PWM && (on_level))
#define ACTIVE_HIGH                  ((0 BOARD_OUTPUTS(LEVEL)) != 0)

/* The pin goes low there, and so high where it is active low. */
#define DARK (ACTIVE_HIGH ? 0u : PWM_NEVER)

static uint32_t now_hz;

/* While the timer rests the pin keeps its level. It starts one count before the end of a period, so that what
 * OC8RS has, dark, is taken before anything else. */
static void change(const struct pwm_period *period) {
    spindle_pwm_set(DARK);
    T6CON = 0;
    PR6 = period->counts - 1;
    TMR6 = period->counts - 2;
    T6CON = TCON_ON | period->shift << TCON_PRESCALE;
}

struct duty_register spindle_pwm_tune(uint32_t hz) {
    const struct pwm_period period = pwm_period_of(CLOCK_BUS_HZ, hz);
    const uint16_t counts = (uint16_t)period.counts;
    if (hz != now_hz)
        change(&period);
    now_hz = hz;
    return ACTIVE_HIGH ? (struct duty_register){.dark = DARK, .least = 1, .full = counts}
                       : (struct duty_register){.dark = DARK, .least = (uint16_t)(counts - 1u), .full = 0};
}

void spindle_pwm_init(const struct output_wire *wire) {
    OC8R = DARK;
    spindle_pwm_set(DARK);
    OC8CON = OCM_PWM | OCCON_ON;
    (void)spindle_pwm_tune(START_HZ);
    /* Last: until then the port keeps the pin at its safe level. */
    RPR(wire->pin) = RPE3_IS_OC8;
}

void spindle_pwm_release(void) {
    if (PIN_SPINDLE_PWM != PIN_NONE)
        RPR(PIN_SPINDLE_PWM) = 0;
}
