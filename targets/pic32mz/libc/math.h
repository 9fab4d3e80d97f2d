/* SPDX-License-Identifier: MIT
 * What the core uses of <math.h>: only functions whose result IEEE 754 fixes to the bit, so that this chip
 * computes what the host computes. fabs and sqrt are one instruction each. */
#ifndef WIFICNC_PIC32MZ_MATH_H
#define WIFICNC_PIC32MZ_MATH_H

static inline double fabs(double x) {
    return __builtin_fabs(x);
}
static inline float fabsf(float x) {
    return __builtin_fabsf(x);
}
static inline double sqrt(double x) {
    return __builtin_sqrt(x);
}
static inline float sqrtf(float x) {
    return __builtin_sqrtf(x);
}
static inline double copysign(double x, double sign) {
    return __builtin_copysign(x, sign);
}

#define isnan(x)    __builtin_isnan(x)
#define isinf(x)    __builtin_isinf_sign(x)
#define isfinite(x) __builtin_isfinite(x)
#define signbit(x)  __builtin_signbit(x)
#define INFINITY    __builtin_inff()
#define NAN         __builtin_nanf("")
#define HUGE_VAL    __builtin_huge_val()

double trunc(double x);
double floor(double x);
double ceil(double x);
double fmod(double x, double y);
double frexp(double x, int *exponent);
double ldexp(double x, int exponent);

#endif
