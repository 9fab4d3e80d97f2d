/* SPDX-License-Identifier: MIT
 * Our own sine, cosine and arc tangent: the same bits on every target, which no two C libraries promise.
 *
 * [any] Pure. Only + - * / and conversions of IEEE 754 binary64 are used, in a fixed order; compile with
 * -ffp-contract=off. Absolute error at most 2.3e-16 (sine, cosine) and
 * 4.5e-16 (arc tangent), see tests/gcode/test_trig.py. Square roots need no help of
 * ours: IEEE 754 fixes every bit of sqrt(). */
#ifndef WIFICNC_BASE_TRIG_H
#define WIFICNC_BASE_TRIG_H

#define TRIG_PI 3.14159265358979323846

/** Sine and cosine of one angle. @param angle_rad  |angle| <= 1e5; the error grows slowly beyond some turns
 */
void trig_sincos(double angle_rad, double *sin_out, double *cos_out);

/** Angle of the vector (x, y) in [-pi, pi]; 0 for the zero vector. Both must be finite. */
double trig_atan2(double y, double x);

#endif
