/* SPDX-License-Identifier: MIT
 * The charge pump: a square wave of the LED PWM, which needs no processor. So that the relay opens when the
 * motion task hangs, the tick interrupt of the other core takes the wave off the pin CHARGE_PUMP_LATE_MS
 * after the task's last sign of life. */
#ifndef WIFICNC_ESP32_CHARGE_PUMP_H
#define WIFICNC_ESP32_CHARGE_PUMP_H

#include "wires.h"

#include <stdbool.h>
#include <stdint.h>

enum { CHARGE_PUMP_LATE_MS = 20 };

/** [start, core 0] The pin stays off. @return false: no timer, no channel or no hook of the tick is free */
bool charge_pump_init(const struct output_wire *wire);

/** [task] @param ticks  of BOARD_PUMP_CLOCK_HZ, of a wave; 0: off */
void charge_pump_set(uint32_t ticks);

/** [motion task, every round] It is alive. */
void charge_pump_beat(void);

#endif
