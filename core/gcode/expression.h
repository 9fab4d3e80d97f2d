/* SPDX-License-Identifier: MIT
 * A number that is computed: text -> double, with LinuxCNC's grammar and precedence. [task] Pure.
 *
 *   value       = [+-]... ( number | "[" expression "]" | "#" reference | function )
 *   expression  = value { operator value }
 *   reference   = "<" name ">" | whole value
 *   function    = ABS ACOS ASIN COS EXP FIX FUP LN ROUND SIN SQRT TAN "[" expression "]"
 *               | ATAN "[" expression "]" "/" "[" expression "]" | EXISTS "[" "#<" name ">" "]"
 *
 * Operators, each row before the next, and from the left within a row:
 *   **    * / MOD    + -    EQ NE GT GE LT LE    AND OR XOR
 *
 * Angles are degrees. The text is filtered and upper case (input/line_reader.h). */
#ifndef WIFICNC_GCODE_EXPRESSION_H
#define WIFICNC_GCODE_EXPRESSION_H

#include "gcode/readings.h"

enum { EXPRESSION_DEPTH_MAX = 16 }; /* brackets, references and signs inside each other */

/** Read the value at *text and move *text behind it.
 *  @return STATUS_BAD_NUMBER: none exists; STATUS_EXPRESSION_*, STATUS_PARAMETER_*: why it has no value.
 *  *text and *value are undefined after an error. The value is finite. */
enum status expression_value(const struct param_context *context, const char **text, double *value);

/** Read what follows a "#" and move *text behind it; ref->name points into the text. */
enum status expression_reference(const struct param_context *context, const char **text,
                                 struct param_ref *ref);

#endif
