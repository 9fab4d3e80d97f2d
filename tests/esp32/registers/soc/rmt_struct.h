/* SPDX-License-Identifier: MIT
 * RMT registers of tests/esp32/pulses.c: each access first looks at what the one before has written. */
#pragma once

#include_next "soc/rmt_struct.h"

rmt_dev_t *emulated_rmt(void);

#define RMT (*emulated_rmt())
