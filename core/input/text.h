/* SPDX-License-Identifier: MIT
 * Text out: a byte sink and the few number formats the protocol needs. [task] No stdio, no buffer of its own.
 */
#ifndef WIFICNC_INPUT_TEXT_H
#define WIFICNC_INPUT_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Where answers go. Chosen at run time; write() takes all bytes or waits. */
struct text_out {
    void (*write)(void *ctx, const char *bytes, size_t count);
    /** While false, no line is begun and no report made: write() would wait. NULL: there is always room. */
    bool (*has_room)(void *ctx);
    void *ctx;
};

static inline bool text_has_room(const struct text_out *out) {
    return out->has_room == NULL || out->has_room(out->ctx);
}

void text_string(const struct text_out *out, const char *string);

/** value in decimal. */
void text_int(const struct text_out *out, int32_t value);

/** value as eight hexadecimal digits, capitals. */
void text_hex(const struct text_out *out, uint32_t value);

/** value with 0 .. 6 decimals, rounded half away from zero; |value| < 1e12. "-0.000" is written "0.000" as in
 * Grbl. */
void text_fixed(const struct text_out *out, double value, unsigned decimals);

#endif
