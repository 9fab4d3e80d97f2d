/* SPDX-License-Identifier: MIT */
#include "program_end.h"

#include "gcode/block.h"
#include "gcode/expression.h"
#include "gcode/number.h"

#include <string.h>

/* Past what is no word of its own: the name of a parameter, an expression. */
static const char *skip_computed(const char *text) {
    int depth = 0;
    do {
        depth += *text == '[' || *text == '<';
        depth -= *text == ']' || *text == '>';
        text++;
    } while (*text != '\0' && depth > 0);
    return text;
}

/* Brackets with numbers and + - * / between them: what every sender can compute. */
static bool is_known(const char *from, const char *end) {
    const size_t length = (size_t)(end - from);
    const char *power = strstr(from, "**");
    return strspn(from, "[]+-*/.0123456789") >= length && (power == NULL || power >= end);
}

/* The number of an M, or 0: none, or not to be known by reading. */
static double code_at(const char *text) {
    const char *bracket = text + (*text == '+');
    if (*bracket == '[') {
        static const struct param_context nothing = {.unknown = NEEDS_ALL};
        double value;
        return is_known(bracket, skip_computed(bracket)) &&
                       expression_value(&nothing, &bracket, &value) == STATUS_OK
                   ? value
                   : 0.0;
    }
    const struct number number = number_scan(text);
    return number.end != NULL ? number_value(number) : 0.0;
}

/* M2 or M30, however it is written. */
static bool has_end_code(const char *line) {
    while (*line != '\0') {
        if (*line == '[' || *line == '<') {
            line = skip_computed(line);
            continue;
        }
        if (*line++ != 'M')
            continue;
        const double value = code_at(line);
        if (value == 2.0 || value == 30.0)
            return true;
    }
    return false;
}

bool program_end_is_percent(const char *line) {
    return strchr(line, '%') != NULL && gcode_is_program_mark(line);
}

/* It could end a program, and does nothing else: M2 and M30, with an N word or a slash. */
static bool is_end_alone(const char *line) {
    line += strspn(line, "/");
    if (*line == 'N')
        line += 1 + strspn(line + 1, "0123456789.");
    line += strspn(line, "/");
    while (*line == 'M') {
        const struct number number = number_scan(line + 1);
        if (number.end == NULL || (number_value(number) != 2.0 && number_value(number) != 30.0))
            return false;
        line = number.end;
    }
    return *line == '\0';
}

static void take_after(struct program_end *end, const char *line, uint32_t number) {
    if (program_end_is_percent(line) && end->is_open) {
        end->is_open = false; /* it closes the program that has ended by M2 or M30 */
    } else if (line[0] == '\0' || gcode_is_program_mark(line)) {
        end->mark = line[0] != '\0' && end->mark == 0 ? number : end->mark;
    } else if (end->unrun == 0 && is_end_alone(line)) {
        end->mark = 0; /* the program that began there has no code */
    } else {
        if (end->unrun++ == 0) {
            end->first = number;
            end->second = end->mark;
        }
        if (end->second == 0 && line[0] != '$' && has_end_code(line))
            end->second = end->first;
    }
}

bool program_end_take(struct program_end *end, const char *line, uint32_t number) {
    if (end->line != 0) {
        take_after(end, line, number);
        return false;
    }
    if (program_end_is_percent(line)) {
        end->line = end->has_code ? number : 0;
        end->is_open = !end->has_code;
    } else if (line[0] != '\0' && !gcode_is_program_mark(line)) {
        end->has_code = true;
        if (line[0] != '$' && has_end_code(line))
            end->line = number;
    }
    return true;
}
