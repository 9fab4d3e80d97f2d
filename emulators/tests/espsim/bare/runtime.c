/* SPDX-License-Identifier: MIT
 * What gcc's and newlib's libraries have on the chip, and its boot ROM does not: exactly rounded. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

enum { FRACTION_BITS = 52, BIAS = 1023, EXPONENT_MAX = 0x7FF };

/* One instruction of the chip's sequence has the exact result in the virtual chip (docs/espsim.md); those
 * that wait are there so that all of it takes as long as the sequence, about 30 instructions. */
#define WAIT ".rept 22\n\tnop\n\t.endr"

float __divsf3(float a, float b) {
    uint32_t bits, from;
    memcpy(&bits, &b, sizeof bits);
    memcpy(&from, &a, sizeof from);
    __asm__("wfr f0, %0\n\twfr f1, %1\n\tmkdadj.s f0, f1\n\t" WAIT "\n\trfr %0, f0"
            : "+r"(bits)
            : "r"(from)); /* no float is in a register here */
    memcpy(&b, &bits, sizeof b);
    return b;
}

float sqrtf(float x) {
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    __asm__("wfr f0, %0\n\tmksadj.s f0, f0\n\t" WAIT "\n\trfr %0, f0" : "+r"(bits));
    memcpy(&x, &bits, sizeof x);
    return x;
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
