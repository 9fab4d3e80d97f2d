/* SPDX-License-Identifier: MIT
 * The one answer that each line gets. [task] */
#ifndef WIFICNC_MACHINE_ANSWER_H
#define WIFICNC_MACHINE_ANSWER_H

#include "gcode/status.h"
#include "machine/machine.h"

/** The one answer of the present line; one that is stored is answered when that is done. */
void answer_line(struct machine *machine, enum status status);

#endif
