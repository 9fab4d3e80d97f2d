/* SPDX-License-Identifier: MIT
 * $ lines: what each needs, and in which states it is possible. Order of the checks as in Grbl. [task] */
#ifndef WIFICNC_MACHINE_COMMAND_H
#define WIFICNC_MACHINE_COMMAND_H

#include "machine/machine.h"

/** A $ line (without line end). Answers it, unless it became a task. */
void command_line(struct machine *machine, const char *line);

#endif
