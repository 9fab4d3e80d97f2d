/* SPDX-License-Identifier: MIT
 * What a program knows of its machine while it runs without it. [task] Pure.
 *
 * At first nothing: modes, offsets and positions may be any. A line that sets a mode makes it known; one that
 * goes to an absolute place makes that axis' position in work coordinates known, until the offsets change
 * under it. What a probe finds never is. So a program may read what it has set itself, and nothing else. */
#ifndef WIFICNC_SIM_KNOWLEDGE_H
#define WIFICNC_SIM_KNOWLEDGE_H

#include "gcode/gcode.h"
#include "gcode/readings.h"

/** What is unknown after a line.
 *  @param unknown  NEEDS_ bits before it
 *  @param line     plain and filtered; its command is what gcode_line() made of it without an error
 *  @return NEEDS_ bits after it */
uint32_t knowledge_after(uint32_t unknown, const char *line, const struct gcode_command *command);

#endif
