/* SPDX-License-Identifier: MIT
 * A line with expressions and assignments -> the plain line that it means, and what it assigns. [task] Pure.
 *
 *   "#2=[#1*2] G1 X#1 F[600/2]"  with #1 = 5  ->  "G1X5F300"  and  #2 = 10
 *
 * Everything behind works with plain lines: gcode_parse() knows no expressions, so that lines without them
 * cost nothing. Assignments take effect after all values of the line were read, and only if the line is
 * accepted: the caller does them (params_set()). */
#ifndef WIFICNC_GCODE_FORMULA_H
#define WIFICNC_GCODE_FORMULA_H

#include "config.h"
#include "gcode/readings.h"

enum {
    FORMULA_DIGITS = 15, /* significant, of a computed value: as many as a double gives back unchanged */
    FORMULA_DECIMALS = 22,
    FORMULA_TEXT_SIZE = 640,          /* every letter with the longest value fits */
    FORMULA_SETS_MAX = LINE_SIZE / 4, /* assignments of one line: each takes four characters */
};

/** The result. The names in sets point into the line that was read. */
struct formula {
    char text[FORMULA_TEXT_SIZE]; /* NUL-terminated; empty when the line but assigns */
    struct param_set sets[FORMULA_SETS_MAX];
    uint8_t set_count;
};

/** The line has "#" or "[", or begins with an O word. @param line  filtered, upper case, NUL-terminated */
bool formula_is(const char *line);

/** Compute a line.
 *  @param decimals  at most so many behind the point of a computed value, 0 .. FORMULA_DECIMALS
 *  @return STATUS_O_WORD for an O word: a line has none; STATUS_EXPRESSION_*,
 * STATUS_PARAMETER_*, STATUS_EXPECTED_LETTER, STATUS_BAD_NUMBER, STATUS_LINE_TOO_LONG: more text or
 * assignments than fit. *out is then undefined. */
enum status formula_compute(const struct param_context *context, const char *line, unsigned decimals,
                            struct formula *out);

#endif
