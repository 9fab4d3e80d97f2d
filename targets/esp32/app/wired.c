/* SPDX-License-Identifier: MIT */
#include "app/wired.h"

#include "machine/machine.h"
#include "step_pins.h"

#include <stddef.h>

uint8_t wired_digital_outputs(const struct pin_map *map) {
    unsigned count = SIGNAL_MISC_OUT_4 - SIGNAL_MISC_OUT_0 + 1;
    while (count > 0 && map->wire[SIGNAL_MISC_OUT_0 + count - 1].gpio == NO_PIN)
        count--;
    return (uint8_t)count;
}

uint8_t wired_outputs(const struct pin_map *map) {
    static const struct {
        enum board_signal signal;
        uint8_t bits;
    } wires[] = {
        {SIGNAL_SPINDLE_ENABLE, BOARD_OUTPUT_SPINDLE},
        {SIGNAL_SPINDLE_PWM, BOARD_OUTPUT_SPINDLE | BOARD_OUTPUT_PWM},
        {SIGNAL_SPINDLE_DIR, BOARD_OUTPUT_REVERSE},
        {SIGNAL_COOLANT_FLOOD, BOARD_OUTPUT_FLOOD},
        {SIGNAL_COOLANT_MIST, BOARD_OUTPUT_MIST},
        {SIGNAL_SERVO, BOARD_OUTPUT_SERVO},
    };
    unsigned outputs = 0;
    for (size_t n = 0; n < sizeof wires / sizeof wires[0]; n++)
        outputs |= map->wire[wires[n].signal].gpio != NO_PIN ? wires[n].bits : 0u;
    return (uint8_t)outputs;
}
