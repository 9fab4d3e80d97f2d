/* SPDX-License-Identifier: MIT
 * A restart that was not requested: its alarm, and its cause in words. [task] */
#ifndef WIFICNC_MACHINE_RESTART_H
#define WIFICNC_MACHINE_RESTART_H

#include "machine/machine.h"

/** Print "watchdog" or "fault at 0x9D001234 0x9D004321 (bus error)". Nothing where this start was requested.
 */
void restart_describe(const struct machine *machine, const struct text_out *out);

/** The alarm and its cause, at each banner until the machine is unlocked or homed. */
void restart_report(struct machine *machine);

#endif
