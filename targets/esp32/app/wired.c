/* SPDX-License-Identifier: MIT */
#include "app/wired.h"

#include "hal/step_pins.h"
#include "machine/machine.h"

#include <stddef.h>

uint8_t wired_outputs(const struct pin_map *map) {
    static const struct {
        const char *signal;
        uint8_t bits;
    } wires[] = {
        {"spindle_enable", BOARD_OUTPUT_SPINDLE}, {"spindle_pwm", BOARD_OUTPUT_SPINDLE | BOARD_OUTPUT_PWM},
        {"spindle_dir", BOARD_OUTPUT_REVERSE},    {"coolant_flood", BOARD_OUTPUT_FLOOD},
        {"coolant_mist", BOARD_OUTPUT_MIST},      {"servo", BOARD_OUTPUT_SERVO}};
    unsigned outputs = 0;
    for (size_t n = 0; n < sizeof wires / sizeof wires[0]; n++)
        outputs |= pin_map_find(map, wires[n].signal)->gpio != GPIO_NONE ? wires[n].bits : 0u;
    return (uint8_t)outputs;
}
