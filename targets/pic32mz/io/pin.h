/* SPDX-License-Identifier: MIT
 * One pin by its number, 16 * port (A = 0) + bit, as pin_config.h has it. [any context: each is one bus
 * access a register] */
#ifndef WIFICNC_PIC32MZ_PIN_H
#define WIFICNC_PIC32MZ_PIN_H

#include "chip/sfr.h"
#include "pin_config.h"
#include "step_pins.h"

#include <stdbool.h>
#include <stdint.h>

_Static_assert((unsigned)NO_PIN == (unsigned)PIN_NONE, "no pin is the same number in both");

static inline uint32_t pin_bit(uint8_t pin) {
    return 1u << pin % PORT_WIDTH;
}

static inline unsigned pin_port(uint8_t pin) {
    return pin / PORT_WIDTH;
}

static inline void pin_write(uint8_t pin, bool level) {
    if (level)
        SFR_SET(LAT_ADDRESS(pin_port(pin))) = pin_bit(pin);
    else
        SFR_CLR(LAT_ADDRESS(pin_port(pin))) = pin_bit(pin);
}

/** [start] First the level, then the driver. */
static inline void pin_make_output(uint8_t pin, bool level) {
    pin_write(pin, level);
    SFR_CLR(ANSEL_ADDRESS(pin_port(pin))) = pin_bit(pin);
    SFR_CLR(TRIS_ADDRESS(pin_port(pin))) = pin_bit(pin);
}

/** [start] @param pull  PIN_PULL_ of pin_config.h */
static inline void pin_make_input(uint8_t pin, uint8_t pull) {
    SFR_SET(TRIS_ADDRESS(pin_port(pin))) = pin_bit(pin);
    SFR_CLR(ANSEL_ADDRESS(pin_port(pin))) = pin_bit(pin);
    if (pull == PIN_PULL_UP)
        SFR_SET(CNPU_ADDRESS(pin_port(pin))) = pin_bit(pin);
    if (pull == PIN_PULL_DOWN)
        SFR_SET(CNPD_ADDRESS(pin_port(pin))) = pin_bit(pin);
}

#endif
