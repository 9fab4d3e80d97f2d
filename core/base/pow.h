/* SPDX-License-Identifier: MIT
 * Our own exponential, logarithm and power: the same bits on every target, which no two C libraries promise.
 *
 * [any] Pure. Only + - * / and frexp(), ldexp(), floor(), fmod() of IEEE 754 binary64 are used, in a fixed
 * order, and those four are exact; compile with -ffp-contract=off. Relative error at most 4e-16 (e^x, and x^y
 * for whole |y| <= 3), for ln x absolute 2e-16 or relative 4e-16, whichever is more;
 * tests/gcode/test_power.py. */
#ifndef WIFICNC_BASE_POW_H
#define WIFICNC_BASE_POW_H

/** e^x. Infinity above 709.78, 0 below -745.1. @param x  finite */
double power_exp(double x);

/** Natural logarithm. @param x  finite, > 0 */
double power_ln(double x);

/** base^exponent; 0^0 = 1. Whole exponents up to 1024 by multiplication: the error is that of log2(exponent)
 * products; others by e^(y ln x), whose relative error grows to 1e-13 for the largest results.
 *  @param base  finite; not negative unless the exponent is whole @return infinity for what is too large, and
 *  for 0 to a negative power */
double power_raise(double base, double exponent);

#endif
