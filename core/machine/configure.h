/* SPDX-License-Identifier: MIT
 * What settings mean for the rest of the machine. [task] */
#ifndef WIFICNC_MACHINE_CONFIGURE_H
#define WIFICNC_MACHINE_CONFIGURE_H

#include "gcode/status.h"
#include "machine/machine.h"

/** All that follows from the settings is as they are now. Nothing moves. */
void configure_apply(struct machine *machine);

/** The spindle's PWM is as $33 to $36 have it, and a laser's curve as $94 to $97; from outputs_apply() on. */
void configure_pwm(struct machine *machine);

/** Settings that no one has set and whose default is the board's: $0 and $73. */
void configure_board_defaults(struct machine *machine);

/** $number=value, in force immediately and not kept. */
enum status configure_set(struct machine *machine, uint16_t number, double value);

#endif
