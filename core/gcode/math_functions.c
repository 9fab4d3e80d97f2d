/* SPDX-License-Identifier: MIT */
#include "gcode/math_functions.h"

#include "base/pow.h"
#include "base/trig.h"

#include <math.h>

#define DEG_PER_RAD (180.0 / TRIG_PI)

/* sin and cos of the quarter turn nearest to the angle are exact; the rest is at most 45 degrees. */
static void sincos_deg(double angle, double *sin_out, double *cos_out) {
    const double turned = fmod(angle, 360.0);
    const double quarter = floor(turned / 90.0 + 0.5);
    double s, c;

    trig_sincos((turned - quarter * 90.0) / DEG_PER_RAD, &s, &c);
    switch ((int)quarter & 3) {
    case 0:
        *sin_out = s, *cos_out = c;
        break;
    case 1:
        *sin_out = c, *cos_out = -s;
        break;
    case 2:
        *sin_out = -s, *cos_out = -c;
        break;
    default:
        *sin_out = -c, *cos_out = s;
        break;
    }
}

double function_atan2_deg(double y, double x) {
    return trig_atan2(y, x) * DEG_PER_RAD;
}

enum status function_power(double base, double exponent, double *value) {
    if (base < 0.0 && floor(exponent) != exponent)
        return STATUS_EXPRESSION_RANGE;
    *value = power_raise(base, exponent);
    return isfinite(*value) ? STATUS_OK : STATUS_EXPRESSION_RESULT;
}

enum status function_modulo(double a, double b, double *value) {
    double rest;

    if (b == 0.0)
        return STATUS_EXPRESSION_DIVISION;
    rest = fmod(a, b);
    /* Never negative, other than C's fmod(): as in RS274/NGC. */
    *value = rest < 0.0 ? rest + fabs(b) : rest;
    return STATUS_OK;
}

static enum status call_abs(double x, double *value) {
    *value = fabs(x);
    return STATUS_OK;
}

/* acos x = atan2(sqrt(1 - x^2), x), with (1 - x)(1 + x) for 1 - x^2, which loses no digits near 1. By our
 * own atan2, because libm's acos does not have the same bits everywhere. */
static enum status call_acos(double x, double *value) {
    if (fabs(x) > 1.0)
        return STATUS_EXPRESSION_RANGE;
    *value = function_atan2_deg(sqrt((1.0 - x) * (1.0 + x)), x);
    return STATUS_OK;
}

static enum status call_asin(double x, double *value) {
    if (fabs(x) > 1.0)
        return STATUS_EXPRESSION_RANGE;
    *value = function_atan2_deg(x, sqrt((1.0 - x) * (1.0 + x)));
    return STATUS_OK;
}

static enum status call_cos(double x, double *value) {
    double s;

    sincos_deg(x, &s, value);
    return STATUS_OK;
}

static enum status call_exp(double x, double *value) {
    *value = power_exp(x);
    return STATUS_OK;
}

/* Down to the next whole number: FIX[-2.8] is -3. */
static enum status call_fix(double x, double *value) {
    *value = floor(x);
    return STATUS_OK;
}

static enum status call_fup(double x, double *value) {
    *value = ceil(x);
    return STATUS_OK;
}

static enum status call_ln(double x, double *value) {
    if (x <= 0.0)
        return STATUS_EXPRESSION_RANGE;
    *value = power_ln(x);
    return STATUS_OK;
}

/* Halves go away from zero. trunc(x + 0.5) would be wrong just below a half. */
static enum status call_round(double x, double *value) {
    const double whole = trunc(x);

    *value = fabs(x - whole) >= 0.5 ? whole + copysign(1.0, x) : whole;
    return STATUS_OK;
}

static enum status call_sin(double x, double *value) {
    double c;

    sincos_deg(x, value, &c);
    return STATUS_OK;
}

static enum status call_sqrt(double x, double *value) {
    if (x < 0.0)
        return STATUS_EXPRESSION_RANGE;
    *value = sqrt(x);
    return STATUS_OK;
}

/* At odd quarter turns there is none. */
static enum status call_tan(double x, double *value) {
    double s, c;

    sincos_deg(x, &s, &c);
    if (c == 0.0)
        return STATUS_EXPRESSION_RANGE;
    *value = s / c;
    return STATUS_OK;
}

const struct function functions[] = {
    {"ABS", call_abs},     {"ACOS", call_acos}, {"ASIN", call_asin}, {"COS", call_cos},
    {"EXP", call_exp},     {"FIX", call_fix},   {"FUP", call_fup},   {"LN", call_ln},
    {"ROUND", call_round}, {"SIN", call_sin},   {"SQRT", call_sqrt}, {"TAN", call_tan},
};
const size_t function_count = sizeof functions / sizeof functions[0];
