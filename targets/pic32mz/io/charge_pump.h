/* SPDX-License-Identifier: MIT
 * The charge pump: an interrupt of timer 9 for each half wave, some 70 instructions. It ends
 * CHARGE_PUMP_LATE_MS after the main loop's last sign of life. */
#ifndef WIFICNC_PIC32MZ_CHARGE_PUMP_H
#define WIFICNC_PIC32MZ_CHARGE_PUMP_H

#include "hal/hal.h"
#include "wires.h"

enum { CHARGE_PUMP_LATE_MS = 20 };

/** [start] @param wire  is copied; without a pin there is no charge pump */
void charge_pump_init(const struct output_wire *wire);

/** [start] @return NULL: there is none */
const struct hal_pump *charge_pump_hal(void);

/** [task, every ms] The main loop is alive. */
void charge_pump_beat(void);

/** [isr] */
void on_pump_timer(void);

#endif
