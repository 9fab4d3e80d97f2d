/* SPDX-License-Identifier: MIT
 * What settings mean for the rest of the machine. [task] */
#ifndef WIFICNC_MACHINE_CONFIGURE_H
#define WIFICNC_MACHINE_CONFIGURE_H

#include "gcode/status.h"
#include "machine/machine.h"

/** All that follows from the settings is as they are now. Nothing moves. */
void configure_apply(struct machine *machine);

/** $0 as the board brings it: its step pulse in whole us, rounded up. */
uint16_t configure_board_pulse_us(const struct machine *machine);

/** What $0 is when nobody has set it. */
uint16_t configure_default_pulse_us(const struct machine *machine);

/** $88 has changed. */
void thread_set_encoder(struct machine *machine);

/** $number=value, in force at once and not kept. */
enum status configure_set(struct machine *machine, uint16_t number, double value);

#endif
