/* SPDX-License-Identifier: MIT
 * The status report. [task] */
#ifndef WIFICNC_MACHINE_STATUS_H
#define WIFICNC_MACHINE_STATUS_H

#include "machine/machine.h"

/** Answer `?`. @param all  0x87: with work offset, overrides and outputs, also when they did not change */
void status_report(struct machine *machine, bool all);

#endif
