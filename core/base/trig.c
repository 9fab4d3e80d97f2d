/* SPDX-License-Identifier: MIT */
#include "base/trig.h"

#include <math.h> // fabs
#include <stdint.h>

/* pi/2 in three pieces (Cody and Waite). The first two have 33 bits, so that their products with a quadrant
 * number below 2^20 are exact. */
#define HALF_PI_HIGH 0x1.921fb544p+0
#define HALF_PI_MID  0x1.0b4611a6p-34
#define HALF_PI_LOW  0x1.3198a2e037073p-69

/* Taylor series; the first term left out is (pi/4)^19/19! = 8e-20 and (pi/4)^18/18! = 2e-18. */
static double sin_series(double x) {
    const double xx = x * x;
    double sum = 2.8114572543455206e-15;    /* 1/17! */
    sum = sum * xx - 7.647163731819816e-13; /* 1/15! ... */
    sum = sum * xx + 1.6059043836821613e-10;
    sum = sum * xx - 2.505210838544172e-08;
    sum = sum * xx + 2.7557319223985893e-06;
    sum = sum * xx - 0.0001984126984126984;
    sum = sum * xx + 0.008333333333333333;
    sum = sum * xx - 0.16666666666666666;
    return x + x * (xx * sum);
}

static double cos_series(double x) {
    const double xx = x * x;
    double sum = 4.779477332387385e-14;      /* 1/16! */
    sum = sum * xx - 1.1470745597729725e-11; /* 1/14! ... */
    sum = sum * xx + 2.08767569878681e-09;
    sum = sum * xx - 2.755731922398589e-07;
    sum = sum * xx + 2.48015873015873e-05;
    sum = sum * xx - 0.001388888888888889;
    sum = sum * xx + 0.041666666666666664;
    sum = sum * xx - 0.5;
    return 1.0 + xx * sum;
}

void trig_sincos(double angle_rad, double *sin_out, double *cos_out) {
    const double turns4 = angle_rad * (2.0 / TRIG_PI);
    /* To the nearest quarter turn, so that the series get at most pi/4. */
    const int32_t quadrant = (int32_t)(turns4 + (turns4 < 0.0 ? -0.5 : 0.5));
    const double k = quadrant;
    const double x = ((angle_rad - k * HALF_PI_HIGH) - k * HALF_PI_MID) - k * HALF_PI_LOW;
    const double s = sin_series(x), c = cos_series(x);

    switch ((uint32_t)quadrant & 3u) {
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

/* atan(t), 0 <= t <= 1, from the nearest k/8: atan t = atan k/8 + atan z, z = (t - k/8)/(1 + t k/8), |z| <=
 * 1/16. The series leaves out z^15/15 = 6e-20. */
static double atan_unit(double t) {
    static const double atan_eighths[9] = {
        0.0,
        0.12435499454676144,
        0.24497866312686414,
        0.35877067027057225,
        0.4636476090008061,
        0.5585993153435624,
        0.6435011087932844,
        0.7188299996216245,
        0.7853981633974483,
    };
    const int32_t k = (int32_t)(t * 8.0 + 0.5);
    const double base = k * 0.125;
    const double z = (t - base) / (1.0 + t * base);
    const double zz = z * z;
    double sum = 1.0 / 13.0;
    sum = sum * zz - 1.0 / 11.0;
    sum = sum * zz + 1.0 / 9.0;
    sum = sum * zz - 1.0 / 7.0;
    sum = sum * zz + 1.0 / 5.0;
    sum = sum * zz - 1.0 / 3.0;
    return atan_eighths[k] + (z + z * (zz * sum));
}

double trig_atan2(double y, double x) {
    const double ax = fabs(x), ay = fabs(y);
    double angle;

    if (ax == 0.0 && ay == 0.0)
        return 0.0;
    /* The smaller divided by the larger one: atan_unit() takes 0 .. 1, and no quotient overflows. */
    angle = ay <= ax ? atan_unit(ay / ax) : TRIG_PI / 2.0 - atan_unit(ax / ay);
    if (x < 0.0)
        angle = TRIG_PI - angle;
    return y < 0.0 ? -angle : angle;
}
