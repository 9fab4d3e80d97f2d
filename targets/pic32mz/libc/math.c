/* SPDX-License-Identifier: MIT */
#include <math.h>

#include <stdint.h>
#include <string.h>

/* binary64 */
enum { FRACTION_BITS = 52, BIAS = 1023, EXPONENT_MAX = 0x7FF };

static uint64_t bits_of(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static double from_bits(uint64_t bits) {
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static int exponent_of(uint64_t bits) {
    return (int)(bits >> FRACTION_BITS & EXPONENT_MAX);
}

/* The bits behind the point are cut off. */
double trunc(double x) {
    uint64_t bits = bits_of(x);
    int whole = exponent_of(bits) - BIAS; /* bits before the point */
    if (whole >= FRACTION_BITS)
        return x;
    if (whole < 0)
        return copysign(0.0, x);
    return from_bits(bits & ~(UINT64_MAX >> (12 + whole)));
}

double floor(double x) {
    double whole = trunc(x);
    return whole > x ? whole - 1.0 : whole;
}

double ceil(double x) {
    double whole = trunc(x);
    return whole < x ? copysign(whole + 1.0, x) : whole;
}

/* In steps, because 2^exponent alone may be no double although the result is one. */
double ldexp(double x, int exponent) {
    const double up = from_bits((uint64_t)(BIAS + 1023) << FRACTION_BITS); /* 2^1023 */
    const double down =
        from_bits((uint64_t)(BIAS - 969) << FRACTION_BITS); /* 2^-969: rounds once, at the end */
    for (int i = 0; i < 2 && exponent > 1023; i++, exponent -= 1023)
        x *= up;
    for (int i = 0; i < 2 && exponent < -1022; i++, exponent += 969)
        x *= down;
    exponent = exponent > 1023 ? 1023 : exponent < -1022 ? -1022 : exponent;
    return x * from_bits((uint64_t)(BIAS + exponent) << FRACTION_BITS);
}

double frexp(double x, int *exponent) {
    uint64_t bits = bits_of(x);
    *exponent = 0;
    if (x == 0.0 || exponent_of(bits) == EXPONENT_MAX)
        return x;
    *exponent = exponent_of(bits) - (BIAS - 1);
    return from_bits((bits & ~((uint64_t)EXPONENT_MAX << FRACTION_BITS)) | (uint64_t)(BIAS - 1)
                                                                               << FRACTION_BITS);
}

/* Long division, bit by bit: exact. */
double fmod(double x, double y) {
    uint64_t a = bits_of(x) & (UINT64_MAX >> 1), b = bits_of(y) & (UINT64_MAX >> 1);
    int ea = exponent_of(a), eb = exponent_of(b);
    if (eb == 0 || ea == EXPONENT_MAX || b > (uint64_t)EXPONENT_MAX << FRACTION_BITS)
        return (x * y) / (x * y); /* no number */
    if (a < b)
        return x;
    const uint64_t one = (uint64_t)1 << FRACTION_BITS;
    uint64_t rest = (a & (one - 1)) | one, step = (b & (one - 1)) | one;
    for (; ea > eb; ea--)
        rest = (rest >= step ? rest - step : rest) << 1;
    rest = rest >= step ? rest - step : rest;
    if (rest == 0)
        return copysign(0.0, x);
    while (rest < one) {
        rest <<= 1;
        ea--;
    }
    if (ea <= 0)
        return copysign(0.0, x); /* a denormal: 0 on this chip (FCSR.FS) */
    return copysign(from_bits((rest & (one - 1)) | (uint64_t)ea << FRACTION_BITS), x);
}
