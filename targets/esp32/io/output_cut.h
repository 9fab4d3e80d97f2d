/* SPDX-License-Identifier: MIT
 * Where an output is in the banks of struct output_cut. */
#ifndef WIFICNC_ESP32_OUTPUT_CUT_H
#define WIFICNC_ESP32_OUTPUT_CUT_H

#include "step_pins.h"

#include "hal/step_shift.h"
#include "io/outputs.h"

#include "soc/gpio_struct.h"

/** [any] This output, too, if it is wired. */
static inline __attribute__((always_inline)) void output_cut_add(struct output_cut *cut,
                                                                 const struct output_wire *wire, bool high) {
    if (wire->pin == NO_PIN)
        return;
    const bool shifted = step_shift_has(wire->pin);
    const unsigned bank = shifted ? SHIFTED_BANK : wire->pin / PIN_BANK_WIDTH;
    (high ? cut->high : cut->low)[bank] |=
        shifted ? step_shift_bit(wire->pin) : 1u << wire->pin % PIN_BANK_WIDTH;
}

/** [any] Its GPIO banks become so; the last bank is step_engine_cut()'s. */
static inline __attribute__((always_inline)) void output_cut_pins(const struct output_cut *cut) {
    GPIO.out_w1ts = cut->high[0];
    GPIO.out_w1tc = cut->low[0];
    GPIO.out1_w1ts.val = cut->high[1];
    GPIO.out1_w1tc.val = cut->low[1];
}

#endif
