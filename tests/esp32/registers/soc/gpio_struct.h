/* SPDX-License-Identifier: MIT
 * GPIO registers of tests/esp32/pulses.c: each access first looks at what the one before has written. */
#pragma once

#include_next "soc/gpio_struct.h"

gpio_dev_t *emulated_gpio(void);

#define GPIO (*emulated_gpio())
