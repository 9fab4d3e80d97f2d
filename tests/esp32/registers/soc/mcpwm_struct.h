/* SPDX-License-Identifier: MIT
 * PWM registers of tests/esp32/pulses.c: each access takes its time. */
#pragma once

#include_next "soc/mcpwm_struct.h"

mcpwm_dev_t *emulated_pwm(void);

#define MCPWM0 (*emulated_pwm())
