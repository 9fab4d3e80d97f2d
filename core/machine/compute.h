/* SPDX-License-Identifier: MIT
 * Lines with expressions and parameters, after the plain reading of them has failed: so they cost other lines
 * nothing. [task] */
#ifndef WIFICNC_MACHINE_COMPUTE_H
#define WIFICNC_MACHINE_COMPUTE_H

#include "gcode/status.h"
#include "machine/machine.h"

/** A line that gcode_line() refused may have expressions: compute it into machine->task.command, and take its
 * assignments if it is accepted.
 *  @param refused  what gcode_line() said, and the status of a line without expressions */
enum status compute_line(struct machine *machine, const char *line, enum status refused);

#endif
