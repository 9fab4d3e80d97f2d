/* SPDX-License-Identifier: MIT
 * Alarms, resets, and what is reported after them. [task] */
#ifndef WIFICNC_MACHINE_RESET_H
#define WIFICNC_MACHINE_RESET_H

#include "machine/machine.h"

/** ALARM:n, then quiet for half a second. One after which only a reset helps (alarms.def) stops everything
 * immediately; before another one the caller has stopped the motion. */
void reset_alarm(struct machine *machine, enum alarm alarm);

/** Stop immediately, forget, and have the banner printed. @param alarm  ALARM_NONE: alarm 3 if that stopped
 * motion */
void reset_machine(struct machine *machine, enum alarm alarm);

/** Print the banner and what belongs to it. */
void reset_restart(struct machine *machine);

/** What leads out of a critical alarm, as a message. */
const char *reset_way_out(const struct machine *machine);

/** Whether the e-stop is pressed, or the target locks the machine: a reset then leads into the same alarm.
 * @param inputs  as they are now */
bool reset_is_barred(const struct machine *machine, const struct hal_inputs *inputs);

/** Report what leads out of a critical alarm. While the e-stop is pressed a reset only leads into the next
 * one, and programs that reset at this message would repeat that for ever. */
void reset_tell_way_out(struct machine *machine);

#endif
