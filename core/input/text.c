/* SPDX-License-Identifier: MIT */
#include "input/text.h"

void text_string(const struct text_out *out, const char *string) {
    size_t count = 0;
    while (string[count] != '\0')
        count++;
    out->write(out->ctx, string, count);
}

/* Digits of value, the last `decimals` of them behind a point. */
static void write_scaled(const struct text_out *out, uint64_t value, int negative, unsigned decimals) {
    char buffer[32];
    size_t at = sizeof buffer;
    for (unsigned digit = 0; value != 0 || digit <= decimals; digit++) {
        if (digit == decimals && decimals != 0)
            buffer[--at] = '.';
        buffer[--at] = (char)('0' + value % 10);
        value /= 10;
    }
    if (negative)
        buffer[--at] = '-';
    out->write(out->ctx, buffer + at, sizeof buffer - at);
}

void text_int(const struct text_out *out, int32_t value) {
    write_scaled(out, (uint64_t)(value < 0 ? -(int64_t)value : value), value < 0, 0);
}

void text_hex(const struct text_out *out, uint32_t value) {
    char digits[] = "00000000";
    for (unsigned at = sizeof digits - 1; at-- > 0; value >>= 4)
        digits[at] = "0123456789ABCDEF"[value & 15u];
    text_string(out, digits);
}

void text_fixed(const struct text_out *out, double value, unsigned decimals) {
    static const double power[] = {1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6};
    double scaled = (value < 0.0 ? -value : value) * power[decimals] + 0.5;
    uint64_t whole = (uint64_t)scaled;
    write_scaled(out, whole, value < 0.0 && whole != 0, decimals);
}
