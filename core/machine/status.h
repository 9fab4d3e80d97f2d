/* SPDX-License-Identifier: MIT
 * The status report. [task] */
#ifndef WIFICNC_MACHINE_STATUS_H
#define WIFICNC_MACHINE_STATUS_H

#include "machine/machine.h"

/** Answer ?. */
void status_report(struct machine *machine);

#endif
