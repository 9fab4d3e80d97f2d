/* SPDX-License-Identifier: MIT */
#include "gcode/number.h"

const double number_power_of_ten[NUMBER_DECIMALS_MAX + 1] = {
    1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
};

struct number number_scan_long(const char *text, bool negative) {
    const int64_t full = 100000000000000000; /* one digit more still fits */
    struct number number = {.end = NULL, .digits = 0, .decimals = 0, .negative = negative};

    text += !negative && *text == '+';
    if (number_digit(text[*text == '.']) > 9)
        return number;
    for (; number_digit(*text) <= 9; text++) {
        if (number.digits >= full)
            return number;
        number.digits = number.digits * 10 + (int64_t)number_digit(*text);
    }
    if (*text == '.') {
        for (text++; number_digit(*text) <= 9; text++) {
            if (number.digits >= full || number.decimals >= NUMBER_DECIMALS_MAX)
                continue;
            number.digits = number.digits * 10 + (int64_t)number_digit(*text);
            number.decimals++;
        }
    }
    number.end = text;
    return number;
}

const char *number_read(const char *text, double *value) {
    const struct number number = number_scan(text);

    if (number.end != NULL)
        *value = number_value(number);
    return number.end;
}
