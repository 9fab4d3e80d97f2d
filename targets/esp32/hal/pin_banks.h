/* SPDX-License-Identifier: MIT
 * The banks of this chip's pins: GPIO 0..31 and GPIO 32..63. A pin's number is 32 * bank + bit. */
#ifndef WIFICNC_PIN_BANKS_H
#define WIFICNC_PIN_BANKS_H

#include <stdint.h>

enum { PIN_BANKS = 2, PIN_BANK_WIDTH = 32, PIN_BANKS_PADDED = PIN_BANKS };

typedef uint32_t pin_bank_t;

#endif
