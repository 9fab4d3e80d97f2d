/* SPDX-License-Identifier: MIT
 * The lines of a program's text. [task] Private to core/gcode. */
#ifndef WIFICNC_SIM_PROGRAM_TEXT_H
#define WIFICNC_SIM_PROGRAM_TEXT_H

#include "program.h"

/** Read the line at program->next into program->text, filtered, and set program->next behind it and
 * program->line to its number. A line that begins with % is empty.
 *  @param more  false: the text ends before this line
 *  @return STATUS_OK, STATUS_PROGRAM_READ, STATUS_LINE_TOO_LONG */
enum status program_read_line(struct program *program, bool *more);

#endif
