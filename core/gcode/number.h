/* SPDX-License-Identifier: MIT
 * Decimal text -> number. Grbl's grammar: sign, digits, one point, digits; at least one digit; no exponent,
 * no hex, no names, no locale. [any] Pure.
 *
 * Two steps, because codes (G38.2) want the decimal and words (X12.5) the double. Both are inlined into the
 * parser: numbers are a third of what a line costs. Everyone else calls number_read(). */
#ifndef WIFICNC_GCODE_NUMBER_H
#define WIFICNC_GCODE_NUMBER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    NUMBER_DIGITS_MAX = 18,   /* significant; 10^18 - 1 fits int64_t */
    NUMBER_DECIMALS_MAX = 22, /* 10^22 is the largest power of ten that a double holds exactly */
};

/** (negative ? -1 : 1) * digits / 10^decimals; digits < 10^18, 0 <= decimals <= 22. */
struct number {
    const char *end; /* first character after it; NULL if there is no number, and the rest is undefined */
    int64_t digits;
    ptrdiff_t decimals;
    bool negative;
};

extern const double number_power_of_ten[NUMBER_DECIMALS_MAX + 1];

/** number_scan() behind the minus: for a plus, no digit, or more than 18, some of which may be but leading
 * zeros. Private. */
struct number number_scan_long(const char *text, bool negative);

/** 0..9, or larger for a character that is not a digit. */
static inline unsigned number_digit(char character) {
    return (unsigned)(unsigned char)character - '0';
}

/** Read the number at the start of NUL-terminated text; one of 10^18 or more is none. Digits after the 18th
 *  significant one and after the 22nd decimal are dropped. */
static inline struct number number_scan(const char *text) {
    struct number number = {.end = NULL, .digits = 0, .decimals = 0, .negative = *text == '-'};
    const char *const start = text += number.negative;
    uint64_t digits = 0; /* may wrap: then it is not used */
    ptrdiff_t characters;
    unsigned digit;

    for (; (digit = number_digit(*text)) <= 9; text++)
        digits = digits * 10 + digit;
    characters = text - start;
    /* cppcheck-suppress knownConditionTrueFalse ; not for an unsigned that has wrapped */
    if (digit == number_digit('.')) {
        const char *const point = text;

        while ((digit = number_digit(*++text)) <= 9)
            digits = digits * 10 + digit;
        number.decimals = text - point - 1;
        characters += number.decimals;
    }
    if ((size_t)characters - 1 >= NUMBER_DIGITS_MAX) /* none, many, or a plus before them */
        return number_scan_long(start, number.negative);
    number.end = text;
    number.digits = (int64_t)digits;
    return number;
}

/** The double nearest to the number for up to 15 significant digits, else within 1 ulp: an integer below 2^53
 *  divided by an exact power of ten is rounded once (Clinger's fast path). */
static inline double number_value(struct number number) {
    double magnitude = (double)number.digits;

    if (number.decimals != 0)
        magnitude /= number_power_of_ten[number.decimals];
    return number.negative ? -magnitude : magnitude;
}

/** number_scan() and number_value(). @return number.end; *value is unchanged if that is NULL */
const char *number_read(const char *text, double *value);

#endif
