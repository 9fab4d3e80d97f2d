/* SPDX-License-Identifier: MIT
 * Arithmetic that gcc-xtensa-lx106 expects in the ROM of its chip: IEEE 754, round to nearest even, and
 * integers wider than the core divides. tests/xtensa compares every function with this computer's hardware.
 *
 * A number is worked on as sign, exponent and 64 bits of significand whose top bit is set: (-1)^sign man
 * 2^(exp - 63). Single precision goes through double: with 53 >= 2 * 24 + 2 bits the second rounding never
 * differs (Figueroa, "When is double rounding innocuous?", 1995). */
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define TOP_BIT  (1ull << 63)
#define QUIET    0x7FF8000000000000ull
#define INFINITE 0x7FF0000000000000ull

enum { BIAS = 1023, FRACTION = 52, EXPONENT_MAX = 0x7FF, FLOAT_BIAS = 127, FLOAT_FRACTION = 23 };

struct number {
    uint64_t man; /* 0: zero */
    int exp;
    unsigned sign;
    bool infinite, nan;
};

static uint64_t bits_of(double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static double from_bits(uint64_t bits) {
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static int leading_zeros(uint64_t word) {
    int count = 0;
    for (; (word & TOP_BIT) == 0; word <<= 1)
        count++;
    return count;
}

static struct number normal(unsigned sign, int exp, uint64_t man) {
    int shift = man == 0 ? 0 : leading_zeros(man);
    return (struct number){.man = man << shift, .exp = exp - shift, .sign = sign};
}

static struct number unpack(double value) {
    uint64_t bits = bits_of(value), fraction = bits & ((1ull << FRACTION) - 1);
    int exponent = (int)(bits >> FRACTION & EXPONENT_MAX);
    unsigned sign = (unsigned)(bits >> 63);
    if (exponent == EXPONENT_MAX)
        return (struct number){.sign = sign, .infinite = fraction == 0, .nan = fraction != 0};
    if (exponent == 0)
        return normal(sign, 1 - BIAS + 63 - FRACTION, fraction);
    return normal(sign, exponent - BIAS + 63 - FRACTION, fraction | 1ull << FRACTION);
}

/* Shifted right; what falls out stays as one low bit. */
static uint64_t shift_sticky(uint64_t word, int by) {
    if (by <= 0)
        return word;
    if (by >= 64)
        return word != 0;
    return word >> by | ((word & ((1ull << by) - 1)) != 0);
}

/* The significand rounded to the format's bits, and the exponent field below it: a carry goes where it
 * belongs. */
static uint64_t rounded(const struct number *number, int bias, int fraction, int exponent_max) {
    int exponent = number->exp + bias, drop = 63 - fraction;
    uint64_t man = number->man;
    if (exponent >= exponent_max)
        return (uint64_t)exponent_max << fraction;
    if (exponent < 1) {
        man = shift_sticky(man, 1 - exponent);
        exponent = 0;
    }
    uint64_t kept = man >> drop, rest = man & ((1ull << drop) - 1), half = 1ull << (drop - 1);
    kept += rest > half || (rest == half && (kept & 1) != 0);
    return exponent == 0 ? kept : ((uint64_t)(exponent - 1) << fraction) + kept;
}

static double pack(const struct number *number) {
    uint64_t sign = (uint64_t)number->sign << 63;
    if (number->nan)
        return from_bits(QUIET);
    if (number->infinite)
        return from_bits(sign | INFINITE);
    return from_bits(sign | (number->man == 0 ? 0 : rounded(number, BIAS, FRACTION, EXPONENT_MAX)));
}

static uint64_t multiply_high(uint64_t a, uint64_t b) {
    uint64_t al = (uint32_t)a, ah = a >> 32, bl = (uint32_t)b, bh = b >> 32;
    uint64_t low = al * bl, middle = ah * bl + (low >> 32), other = al * bh + (uint32_t)middle;
    uint64_t high = ah * bh + (middle >> 32) + (other >> 32);
    return high | ((uint32_t)other != 0 || (uint32_t)low != 0); /* sticky */
}

/* ---- double ---- */

static struct number sum(struct number a, struct number b) {
    if (a.nan || b.nan || (a.infinite && b.infinite && a.sign != b.sign))
        return (struct number){.nan = true};
    if (a.infinite || (!b.infinite && b.man == 0 && a.man != 0))
        return a;
    if (b.infinite || (a.man == 0 && b.man != 0))
        return b;
    if (a.man == 0)
        return (struct number){.sign = a.sign & b.sign};
    if (a.exp < b.exp || (a.exp == b.exp && a.man < b.man)) {
        struct number swap = a;
        a = b;
        b = swap;
    }
    uint64_t large = a.man >> 1, small = shift_sticky(b.man, a.exp - b.exp + 1); /* low bits of both are 0 */
    if (a.sign == b.sign)
        return normal(a.sign, a.exp + 1, large + small);
    return large == small ? (struct number){.sign = 0} : normal(a.sign, a.exp + 1, large - small);
}

double __adddf3(double first, double second) {
    struct number result = sum(unpack(first), unpack(second));
    return pack(&result);
}

double __subdf3(double first, double second) {
    struct number negated = unpack(second);
    negated.sign ^= 1;
    struct number result = sum(unpack(first), negated);
    return pack(&result);
}

double __muldf3(double first, double second) {
    struct number a = unpack(first), b = unpack(second), result = {.sign = a.sign ^ b.sign};
    bool a_is_zero = !a.infinite && !a.nan && a.man == 0, b_is_zero = !b.infinite && !b.nan && b.man == 0;
    result.nan = a.nan || b.nan || (a.infinite && b_is_zero) || (b.infinite && a_is_zero);
    result.infinite = a.infinite || b.infinite;
    if (!result.nan && !result.infinite && !a_is_zero && !b_is_zero)
        result = normal(result.sign, a.exp + b.exp + 1, multiply_high(a.man, b.man));
    return pack(&result);
}

/* a / b, bit by bit; a < 2 b. */
static uint64_t quotient(uint64_t a, uint64_t b) {
    uint64_t result = 0, rest = a;
    for (int bit = 0; bit < 64; bit++) {
        bool carry = (rest & TOP_BIT) != 0 && bit > 0;
        rest = bit > 0 ? rest << 1 : rest;
        result <<= 1;
        if (carry || rest >= b) {
            rest -= b;
            result |= 1;
        }
    }
    return result | (rest != 0); /* sticky */
}

double __divdf3(double first, double second) {
    struct number a = unpack(first), b = unpack(second), result = {.sign = a.sign ^ b.sign};
    bool a_is_zero = !a.infinite && !a.nan && a.man == 0, b_is_zero = !b.infinite && !b.nan && b.man == 0;
    result.nan = a.nan || b.nan || (a.infinite && b.infinite) || (a_is_zero && b_is_zero);
    result.infinite = a.infinite || b_is_zero;
    if (!result.nan && !result.infinite && !a_is_zero && !b.infinite)
        result = normal(result.sign, a.exp - b.exp, quotient(a.man, b.man));
    return pack(&result);
}

/* ---- conversions ---- */

double __extendsfdf2(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    uint32_t fraction = bits & ((1u << FLOAT_FRACTION) - 1);
    int exponent = (int)(bits >> FLOAT_FRACTION & 0xFF);
    struct number result = {.sign = bits >> 31, .infinite = exponent == 0xFF && fraction == 0};
    result.nan = exponent == 0xFF && fraction != 0;
    if (exponent == 0)
        result = normal(bits >> 31, 1 - FLOAT_BIAS + 63 - FLOAT_FRACTION, fraction);
    else if (exponent != 0xFF)
        result =
            normal(bits >> 31, exponent - FLOAT_BIAS + 63 - FLOAT_FRACTION, fraction | 1u << FLOAT_FRACTION);
    return pack(&result);
}

float __truncdfsf2(double value) {
    struct number number = unpack(value);
    uint32_t bits = number.sign << 31;
    float result;
    if (number.nan)
        bits = 0x7FC00000u;
    else if (number.infinite)
        bits |= 0x7F800000u;
    else if (number.man != 0)
        bits |= (uint32_t)rounded(&number, FLOAT_BIAS, FLOAT_FRACTION, 0xFF);
    memcpy(&result, &bits, sizeof result);
    return result;
}

double __floatunsidf(uint32_t value) {
    struct number number = normal(0, 63, value);
    return pack(&number);
}

double __floatsidf(int32_t value) {
    struct number number = normal(value < 0, 63, value < 0 ? 0u - (uint32_t)value : (uint32_t)value);
    return pack(&number);
}

float __floatunsisf(uint32_t value) {
    return __truncdfsf2(__floatunsidf(value));
}

float __floatsisf(int32_t value) {
    return __truncdfsf2(__floatsidf(value));
}

/* Towards zero; what does not fit is undefined in C. */
static uint64_t magnitude(double value) {
    struct number number = unpack(value);
    return number.man == 0 || number.exp < 0 || number.exp > 63 ? 0 : number.man >> (63 - number.exp);
}

int32_t __fixdfsi(double value) {
    uint32_t whole = (uint32_t)magnitude(value);
    return (int32_t)(bits_of(value) >> 63 != 0 ? 0u - whole : whole);
}

uint32_t __fixunsdfsi(double value) {
    return (uint32_t)magnitude(value);
}

uint32_t __fixunssfsi(float value) {
    return (uint32_t)magnitude(__extendsfdf2(value));
}

/* ---- single ---- */

float __addsf3(float first, float second) {
    return __truncdfsf2(__adddf3(__extendsfdf2(first), __extendsfdf2(second)));
}

float __subsf3(float first, float second) {
    return __truncdfsf2(__subdf3(__extendsfdf2(first), __extendsfdf2(second)));
}

float __mulsf3(float first, float second) {
    return __truncdfsf2(__muldf3(__extendsfdf2(first), __extendsfdf2(second)));
}

/* ---- integers ---- */

static uint64_t divide(uint64_t a, uint64_t b, uint64_t *rest) {
    uint64_t result = 0, remainder = 0;
    for (int bit = 63; bit >= 0; bit--) {
        bool carry = (remainder & TOP_BIT) != 0;
        remainder = remainder << 1 | (a >> bit & 1);
        if (carry || remainder >= b) {
            remainder -= b;
            result |= 1ull << bit;
        }
    }
    *rest = remainder;
    return result;
}

uint64_t __udivdi3(uint64_t a, uint64_t b) {
    uint64_t rest;
    return divide(a, b, &rest);
}

uint64_t __umoddi3(uint64_t a, uint64_t b) {
    uint64_t rest;
    (void)divide(a, b, &rest);
    return rest;
}

int64_t __divdi3(int64_t a, int64_t b) {
    uint64_t rest,
        result = divide(a < 0 ? 0 - (uint64_t)a : (uint64_t)a, b < 0 ? 0 - (uint64_t)b : (uint64_t)b, &rest);
    return (int64_t)((a < 0) != (b < 0) ? 0 - result : result);
}

static uint32_t divide_short(uint32_t a, uint32_t b, uint32_t *rest) {
    uint32_t result = 0, remainder = 0;
    for (int bit = 31; bit >= 0; bit--) {
        bool carry = remainder >> 31 != 0;
        remainder = remainder << 1 | (a >> bit & 1);
        if (carry || remainder >= b) {
            remainder -= b;
            result |= 1u << bit;
        }
    }
    *rest = remainder;
    return result;
}

uint32_t __udivsi3(uint32_t a, uint32_t b) {
    uint32_t rest;
    return divide_short(a, b, &rest);
}

uint32_t __umodsi3(uint32_t a, uint32_t b) {
    uint32_t rest;
    (void)divide_short(a, b, &rest);
    return rest;
}

int32_t __divsi3(int32_t a, int32_t b) {
    uint32_t rest, result = divide_short(a < 0 ? 0u - (uint32_t)a : (uint32_t)a,
                                         b < 0 ? 0u - (uint32_t)b : (uint32_t)b, &rest);
    return (int32_t)((a < 0) != (b < 0) ? 0u - result : result);
}

int64_t __moddi3(int64_t a, int64_t b) {
    uint64_t rest;
    (void)divide(a < 0 ? 0 - (uint64_t)a : (uint64_t)a, b < 0 ? 0 - (uint64_t)b : (uint64_t)b, &rest);
    return (int64_t)(a < 0 ? 0 - rest : rest);
}

/* Schoolbook, by halves that the core multiplies. */
uint64_t __umulsidi3(uint32_t a, uint32_t b) {
    uint32_t a0 = a & 0xFFFF, a1 = a >> 16, b0 = b & 0xFFFF, b1 = b >> 16;
    uint32_t low = a0 * b0, middle = a1 * b0 + (low >> 16), other = a0 * b1 + (middle & 0xFFFF);
    uint32_t high = a1 * b1 + (middle >> 16) + (other >> 16);
    return (uint64_t)high << 32 | (other << 16 | (low & 0xFFFF));
}

uint64_t __muldi3(uint64_t a, uint64_t b) {
    uint32_t high = (uint32_t)a * (uint32_t)(b >> 32) + (uint32_t)(a >> 32) * (uint32_t)b;
    return __umulsidi3((uint32_t)a, (uint32_t)b) + ((uint64_t)high << 32);
}
