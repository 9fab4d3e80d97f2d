/* SPDX-License-Identifier: MIT
 * Decimal text -> double. Grbl's grammar: sign, digits, one point, digits; at least one digit; no exponent,
 * no hex, no names, no locale. [any] Pure. */
#ifndef WIFICNC_GCODE_NUMBER_H
#define WIFICNC_GCODE_NUMBER_H

#include <stddef.h> // NULL

/** Numbers of this size and above are refused. */
#define NUMBER_LIMIT 1e18

/** Read the number at the start of NUL-terminated text.
 *
 *  Up to 15 significant digits the result is the double nearest to the decimal; digits after the 18th
 * significant one or after the 22nd decimal are dropped (truncated).
 *  @return the first character after the number; NULL and *value unchanged if there is none or it is too
 * large */
const char *number_read(const char *text, double *value);

#endif
