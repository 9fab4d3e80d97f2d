/* SPDX-License-Identifier: MIT */
#include "gcode/formula.h"

#include "gcode/expression.h"
#include "gcode/number.h"

#include <math.h>
#include <string.h>

/* G and M codes that are computed may be off by this much of a tenth, as in RS274/NGC. */
#define CODE_TOLERANCE 0.0001

#define DIGITS_FULL   1e15 /* 10^FORMULA_DIGITS */
#define LONGEST_VALUE 28   /* sign, 0, point, FORMULA_DECIMALS, and some */

struct writer {
    char *at, *end; /* where the next character goes; where the NUL must go at the latest */
};

bool formula_is(const char *line) {
    if (*line == 'N') {
        for (line++; number_digit(*line) <= 9; line++)
            ;
    }
    return *line == 'O' || strpbrk(line, "#[") != NULL;
}

static bool put(struct writer *writer, const char *text, size_t size) {
    if ((size_t)(writer->end - writer->at) < size)
        return false;
    memcpy(writer->at, text, size);
    writer->at += size;
    *writer->at = '\0';
    return true;
}

/* As many decimals as 15 significant digits leave. */
static unsigned decimals_of(double magnitude, unsigned most) {
    unsigned decimals = 0;

    while (decimals < most && magnitude * number_power_of_ten[decimals + 1] < DIGITS_FULL)
        decimals++;
    return decimals;
}

/* Plain decimal text; number_read() gives back the same double wherever 15 digits say it. */
static bool put_value(struct writer *writer, double value, unsigned most_decimals) {
    const double magnitude = fabs(value);
    unsigned decimals = decimals_of(magnitude, most_decimals);
    /* Below 1e15 (decimals_of()): a double holds such integers exactly. */
    uint64_t digits = (uint64_t)(magnitude * number_power_of_ten[decimals] + 0.5);
    char text[LONGEST_VALUE], *at = text + sizeof text;

    for (; decimals > 0 && digits % 10 == 0; decimals--)
        digits /= 10;
    const bool negative = value < 0.0 && digits != 0;
    for (unsigned place = 0; digits != 0 || place <= decimals; place++) {
        if (place == decimals && decimals > 0)
            *--at = '.';
        *--at = (char)('0' + digits % 10);
        digits /= 10;
    }
    if (negative)
        *--at = '-';
    return put(writer, at, (size_t)(text + sizeof text - at));
}

/* 38.2 computed is not quite 38.2. */
static double nearest_code(double value) {
    const double tenths = floor(value * 10.0 + 0.5);
    return fabs(value * 10.0 - tenths) <= CODE_TOLERANCE ? tenths / 10.0 : value;
}

/* A word's value that is not plain digits: a parameter, a bracket or a function (G[..], X#1, YSIN[30]). */
static bool is_computed(const char *value) {
    return *value != '\0' && strchr("#[ABCDEFGHIJKLMNOPQRSTUVWXYZ", *value) != NULL;
}

/* Signs may come before either kind. */
static const char *after_signs(const char *text) {
    while (*text == '+' || *text == '-')
        text++;
    return text;
}

static enum status put_word(const struct param_context *context, struct writer *writer, const char **line,
                            unsigned decimals) {
    const char letter = **line, *const begin = *line + 1, *end = begin;
    double value;
    enum status status;

    if (!is_computed(after_signs(begin))) { /* as it is, all digits of it */
        end = number_scan(begin).end;
        if (end == NULL)
            return STATUS_BAD_NUMBER;
        *line = end;
        return put(writer, begin - 1, (size_t)(end - begin) + 1) ? STATUS_OK : STATUS_LINE_TOO_LONG;
    }
    status = expression_value(context, &end, &value);
    if (status != STATUS_OK)
        return status;
    if (letter == 'G' || letter == 'M')
        value = nearest_code(value);
    if (fabs(value) >= DIGITS_FULL)
        return STATUS_EXPRESSION_RESULT;
    *line = end;
    return put(writer, &letter, 1) && put_value(writer, value, decimals) ? STATUS_OK : STATUS_LINE_TOO_LONG;
}

/* After "#" at the beginning of a word. */
static enum status take_assignment(const struct param_context *context, struct formula *out,
                                   const char **line) {
    struct param_set *set = &out->sets[out->set_count];
    enum status status;

    if (out->set_count == FORMULA_SETS_MAX)
        return STATUS_LINE_TOO_LONG;
    status = expression_reference(context, line, &set->ref);
    if (status == STATUS_OK)
        status = readings_check_set(&set->ref);
    if (status != STATUS_OK)
        return status;
    if (**line != '=')
        return STATUS_PARAMETER_ASSIGNMENT;
    ++*line;
    status = expression_value(context, line, &set->value);
    if (status == STATUS_OK)
        out->set_count++;
    return status;
}

enum status formula_compute(const struct param_context *context, const char *line, unsigned decimals,
                            struct formula *out) {
    struct writer writer = {.at = out->text, .end = out->text + sizeof out->text - 1};
    enum status status = STATUS_OK;

    out->text[0] = '\0';
    out->set_count = 0;
    while (status == STATUS_OK && *line != '\0') {
        if (*line == '#') {
            line++;
            status = take_assignment(context, out, &line);
        } else if (*line == 'O') {
            status = STATUS_O_WORD;
        } else if (*line >= 'A' && *line <= 'Z') {
            status = put_word(context, &writer, &line, decimals);
        } else {
            status = STATUS_EXPECTED_LETTER;
        }
    }
    return status;
}
