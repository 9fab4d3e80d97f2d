/* SPDX-License-Identifier: MIT
 * The banks of this chip's pins: ports A .. G. A pin's number is 16 * port + bit. One more bank, so that a
 * table's row is 16 bytes. */
#ifndef WIFICNC_PIN_BANKS_H
#define WIFICNC_PIN_BANKS_H

#include "chip/sfr.h"

#include <stdint.h>

enum { PIN_BANKS = PORT_COUNT, PIN_BANK_WIDTH = PORT_WIDTH, PIN_BANKS_PADDED = PIN_BANKS + 1 };

typedef uint16_t pin_bank_t;

#endif
