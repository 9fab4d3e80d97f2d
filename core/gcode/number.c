/* SPDX-License-Identifier: MIT */
#include "gcode/number.h"

#include <stdbool.h>
#include <stdint.h>

enum {
    MANTISSA_DIGITS = 18, /* 10^18 - 1 fits int64_t */
    DECIMALS_MAX = 22,    /* 10^22 is the largest power of ten that a double holds exactly */
};

/* An integer below 2^53 divided by an exact power of ten is rounded once: the nearest double (Clinger's fast
 * path). */
static const double power_of_ten[DECIMALS_MAX + 1] = {
    1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
};

static inline bool digit_at(const char *text, unsigned *digit) {
    *digit = (unsigned)(unsigned char)*text - '0';
    return *digit <= 9;
}

/* Digits too many for the fast path, perhaps only leading zeros. */
static bool read_long(const char *text, double *magnitude) {
    const int64_t full = 100000000000000000; /* one digit more still fits */
    int64_t mantissa = 0;
    int decimals = 0;
    unsigned digit;

    for (; digit_at(text, &digit); text++) {
        if (mantissa >= full)
            return false;
        mantissa = mantissa * 10 + (int64_t)digit;
    }
    if (*text == '.') {
        for (text++; digit_at(text, &digit) && mantissa < full && decimals < DECIMALS_MAX; text++, decimals++)
            mantissa = mantissa * 10 + (int64_t)digit;
    }
    *magnitude = (double)mantissa / power_of_ten[decimals];
    return true;
}

const char *number_read(const char *text, double *value) {
    const bool negative = *text == '-';
    const char *start, *point;
    uint64_t mantissa = 0; /* may wrap: then it is not used */
    ptrdiff_t digits, decimals = 0;
    double magnitude;
    unsigned digit;

    if (*text == '-' || *text == '+')
        text++;
    for (start = text; digit_at(text, &digit); text++)
        mantissa = mantissa * 10 + digit;
    digits = text - start;
    if (*text == '.') {
        for (point = ++text; digit_at(text, &digit); text++)
            mantissa = mantissa * 10 + digit;
        decimals = text - point;
        digits += decimals;
    }
    if (digits == 0)
        return NULL;
    if (digits <= MANTISSA_DIGITS) {
        magnitude = (double)(int64_t)mantissa;
        if (decimals != 0)
            magnitude /= power_of_ten[decimals];
    } else if (!read_long(start, &magnitude)) {
        return NULL;
    }
    *value = negative ? -magnitude : magnitude;
    return text;
}
