/* SPDX-License-Identifier: MIT
 * What gcc's and newlib's libraries have on the chip, and its boot ROM does not: exactly rounded. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

enum { FRACTION_BITS = 52, BIAS = 1023, EXPONENT_MAX = 0x7FF };

/* A quotient or root of doubles, rounded again, is the float's: 53 >= 2 * 24 + 2. volatile: clang knows that,
 * too, and would call the float's function. */
float __divsf3(float a, float b) {
    const volatile double quotient = (double)a / (double)b;
    return (float)quotient;
}

uint64_t __fixunsdfdi(double x) {
    return x < 0x1p63 ? (uint64_t)(int64_t)x : (uint64_t)(int64_t)(x - 0x1p63) + (1ull << 63);
}

int __fpclassifyd(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    const unsigned exponent = (unsigned)(bits >> FRACTION_BITS) & EXPONENT_MAX;
    const bool fraction = bits << 12 != 0;
    if (exponent == EXPONENT_MAX)
        return fraction ? FP_NAN : FP_INFINITE;
    return exponent != 0 ? FP_NORMAL : fraction ? FP_SUBNORMAL : FP_ZERO;
}

/* x = f * 2^e; of f * 2 (e odd) or f * 4, times 2^106, the root has 54 bits, and the last one rounds: it is
 * never just between two doubles. x is normal, or 0. */
double sqrt(double x) {
    int exponent;
    if (x == 0 || !(x > 0))
        return x == 0 ? x : (double)NAN;
    const double fraction = frexp(x, &exponent);
    const int even = (exponent & 1) == 0;
    uint64_t left = (uint64_t)(int64_t)ldexp(fraction, 53) << (10 + even), root = 0, rest = 0;
    for (int bit = 0; bit < 54; bit++) {
        rest = rest << 2 | left >> 62;
        left <<= 2;
        root <<= 1;
        if (rest >= 2 * root + 1) {
            rest -= 2 * root + 1;
            root++;
        }
    }
    root += root & 1;
    return ldexp((double)(int64_t)(root >> 1), (exponent - 1 - even) / 2 - 52);
}

float sqrtf(float x) {
    const volatile double root = sqrt((double)x);
    return (float)root;
}

/* Of complaints about pins, which this program has none of. */
int snprintf(char *restrict to, size_t size, const char *restrict format, ...) {
    (void)format;
    if (size > 0)
        *to = '\0';
    return 0;
}

void *memchr(const void *at, int value, size_t count) {
    const unsigned char *byte = at;
    for (; count > 0; count--, byte++)
        if (*byte == (unsigned char)value)
            return (void *)byte;
    return NULL;
}

char *strchr(const char *text, int wanted) {
    for (; *text != (char)wanted; text++)
        if (*text == '\0')
            return NULL;
    return (char *)text;
}

char *strpbrk(const char *text, const char *wanted) {
    while (*text != '\0' && strchr(wanted, *text) == NULL)
        text++;
    return *text != '\0' ? (char *)text : NULL;
}
