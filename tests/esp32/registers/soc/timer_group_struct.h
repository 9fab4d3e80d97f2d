/* SPDX-License-Identifier: MIT
 * Timer registers of tests/esp32/pulses.c: each access takes its time, and that of the interrupt's own
 * instructions. */
#pragma once

#include_next "soc/timer_group_struct.h"

timg_dev_t *emulated_timer(void);

#define TIMERG0 (*emulated_timer())
