/* SPDX-License-Identifier: MIT */
#include "base/pow.h"

#include <math.h> // fabs, floor, fmod, frexp, ldexp
#include <stdbool.h>

/* ln 2 in two pieces (Cody and Waite): the first has 32 bits, so that its product with an exponent is exact.
 */
#define LN_2      0.6931471805599453
#define LN_2_HIGH 0x1.62e42feep-1
#define LN_2_LOW  0x1.a39ef35793c76p-33

/* Beyond these e^x is infinite or 0 in a double. Whole exponents up to WHOLE_MAX are multiplied out: 2^3
 * is 8 exactly. */
#define EXP_MAX   710.0
#define EXP_MIN   (-746.0)
#define WHOLE_MAX 1024.0

/* Taylor series; |r| <= ln 2 / 2, the first term left out is r^14/14! = 5e-18. */
static double exp_series(double r) {
    static const double inverse_factorial[] = {
        1.0 / 6227020800.0, 1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0,
        1.0 / 362880.0,     1.0 / 40320.0,     1.0 / 5040.0,     1.0 / 720.0,
        1.0 / 120.0,        1.0 / 24.0,        1.0 / 6.0,        1.0 / 2.0,
    };
    double sum = 0.0;

    for (unsigned i = 0; i < sizeof inverse_factorial / sizeof inverse_factorial[0]; i++)
        sum = sum * r + inverse_factorial[i];
    return 1.0 + (r + r * r * sum);
}

double power_exp(double x) {
    double k;

    if (x > EXP_MAX)
        return HUGE_VAL;
    if (x < EXP_MIN)
        return 0.0;
    k = floor(x / LN_2 + 0.5);
    return ldexp(exp_series((x - k * LN_2_HIGH) - k * LN_2_LOW), (int)k);
}

/* ln x = k ln 2 + ln m, ln m = 2 artanh s, s = (m - 1) / (m + 1), |s| <= 0.172; the first term left out is
 * 2 s^25/25 = 6e-21. */
double power_ln(double x) {
    int k;
    double m = frexp(x, &k), s, ss, sum = 0.0;

    /* m from sqrt(1/2) to sqrt(2), around 1, where s is smallest. */
    if (m < 0.70710678118654752) {
        m *= 2.0;
        k--;
    }
    s = (m - 1.0) / (m + 1.0);
    ss = s * s;
    for (int n = 23; n >= 3; n -= 2)
        sum = sum * ss + 1.0 / n;
    return k * LN_2_HIGH + (2.0 * s + (2.0 * s * ss * sum + k * LN_2_LOW));
}

static double raise_whole(double base, unsigned exponent) {
    double result = 1.0;

    for (; exponent != 0; exponent >>= 1, base *= base) {
        if (exponent & 1u)
            result *= base;
    }
    return result;
}

double power_raise(double base, double exponent) {
    const bool whole = floor(exponent) == exponent;
    double result;

    if (base == 0.0)
        return exponent > 0.0 ? 0.0 : exponent == 0.0 ? 1.0 : HUGE_VAL;
    if (whole && fabs(exponent) <= WHOLE_MAX) {
        result = raise_whole(base, (unsigned)fabs(exponent));
        return exponent < 0.0 ? 1.0 / result : result;
    }
    result = power_exp(exponent * power_ln(fabs(base)));
    return base < 0.0 && fmod(exponent, 2.0) != 0.0 ? -result : result;
}
