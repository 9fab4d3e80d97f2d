/* SPDX-License-Identifier: MIT
 * The functions of expressions: arithmetic with the same bits on every target. [any] Pure. Private to
 * core/gcode.
 *
 * Angles are degrees and are brought into one turn before they become radians, so that SIN[180] and COS[90]
 * are exactly 0 and large angles lose nothing. */
#ifndef WIFICNC_GCODE_MATH_FUNCTIONS_H
#define WIFICNC_GCODE_MATH_FUNCTIONS_H

#include "gcode/status.h"

#include <stddef.h>

/** A function of one number. call: @return STATUS_EXPRESSION_RANGE outside of what it is defined for; *value
 * may be infinite */
struct function {
    const char *name;
    enum status (*call)(double x, double *value);
};
extern const struct function functions[];
extern const size_t function_count;

/** Direction of (x, y) in degrees, -180 .. 180; 0 for the zero vector. */
double function_atan2_deg(double y, double x);

/** base ** exponent. @return STATUS_EXPRESSION_RANGE: negative base and a broken exponent */
enum status function_power(double base, double exponent, double *value);

/** a MOD b with 0 <= result < |b|. @return STATUS_EXPRESSION_DIVISION: b is 0 */
enum status function_modulo(double a, double b, double *value);

#endif
