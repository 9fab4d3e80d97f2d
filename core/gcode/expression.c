/* SPDX-License-Identifier: MIT
 * Expressions of RS274/NGC: a recursive descent over values, with a stack of operators within each bracket.
 * All letters are capitals and blanks are gone: the line reader has seen to that. */
#include "gcode/expression.h"

#include "gcode/math_functions.h"
#include "gcode/number.h"

#include <math.h>
#include <string.h>

/* A number that is to be whole may be off by this; numbers that are to be equal by less. RS274/NGC's. */
#define TOLERANCE 0.0001

enum operation {
    OPERATOR_END, /* "]" */
    OPERATOR_POWER,
    OPERATOR_TIMES,
    OPERATOR_DIVIDE,
    OPERATOR_MODULO,
    OPERATOR_PLUS,
    OPERATOR_MINUS,
    OPERATOR_EQ,
    OPERATOR_NE,
    OPERATOR_GT,
    OPERATOR_GE,
    OPERATOR_LT,
    OPERATOR_LE,
    OPERATOR_AND,
    OPERATOR_OR,
    OPERATOR_XOR,
};

/* The first one that the text begins with is taken: ** before *. */
static const struct {
    const char *text;
    uint8_t operation, rank; /* rank: the higher is done first */
} operators[] = {
    {"**", OPERATOR_POWER, 5},   {"*", OPERATOR_TIMES, 4}, {"/", OPERATOR_DIVIDE, 4},
    {"MOD", OPERATOR_MODULO, 4}, {"+", OPERATOR_PLUS, 3},  {"-", OPERATOR_MINUS, 3},
    {"EQ", OPERATOR_EQ, 2},      {"NE", OPERATOR_NE, 2},   {"GT", OPERATOR_GT, 2},
    {"GE", OPERATOR_GE, 2},      {"LT", OPERATOR_LT, 2},   {"LE", OPERATOR_LE, 2},
    {"AND", OPERATOR_AND, 1},    {"OR", OPERATOR_OR, 1},   {"XOR", OPERATOR_XOR, 1},
    {"]", OPERATOR_END, 0},
};
enum { RANK_COUNT = 6 };

struct reader {
    const struct param_context *context;
    const char *text;
    unsigned depth;
};

static enum status read_value(struct reader *reader, double *value);

static bool take(struct reader *reader, const char *word) {
    const size_t length = strlen(word);

    if (strncmp(reader->text, word, length) != 0)
        return false;
    reader->text += length;
    return true;
}

static enum status finite_or_error(double value) {
    return isfinite(value) ? STATUS_OK : STATUS_EXPRESSION_RESULT;
}

/* *left becomes the result. Every result is checked, so that no infinity or NaN reaches a coordinate. */
static enum status calculate(enum operation operation, double right, double *left) {
    const double a = *left;

    switch (operation) {
    case OPERATOR_POWER:
        return function_power(a, right, left);
    case OPERATOR_TIMES:
        *left = a * right;
        break;
    case OPERATOR_DIVIDE:
        if (right == 0.0)
            return STATUS_EXPRESSION_DIVISION;
        *left = a / right;
        break;
    case OPERATOR_MODULO:
        return function_modulo(a, right, left);
    case OPERATOR_PLUS:
        *left = a + right;
        break;
    case OPERATOR_MINUS:
        *left = a - right;
        break;
    case OPERATOR_EQ:
        *left = fabs(a - right) < TOLERANCE;
        break;
    case OPERATOR_NE:
        *left = fabs(a - right) >= TOLERANCE;
        break;
    case OPERATOR_GT:
        *left = a > right;
        break;
    case OPERATOR_GE:
        *left = a >= right;
        break;
    case OPERATOR_LT:
        *left = a < right;
        break;
    case OPERATOR_LE:
        *left = a <= right;
        break;
    case OPERATOR_AND:
        *left = a != 0.0 && right != 0.0;
        break;
    case OPERATOR_OR:
        *left = a != 0.0 || right != 0.0;
        break;
    case OPERATOR_XOR:
        *left = (a != 0.0) != (right != 0.0);
        break;
    case OPERATOR_END:
        break;
    }
    return finite_or_error(*left);
}

static enum status read_operator(struct reader *reader, enum operation *operation, unsigned *rank) {
    for (size_t i = 0; i < sizeof operators / sizeof operators[0]; i++) {
        if (take(reader, operators[i].text)) {
            *operation = (enum operation)operators[i].operation;
            *rank = operators[i].rank;
            return STATUS_OK;
        }
    }
    return *reader->text == '\0' ? STATUS_EXPRESSION_BRACKET : STATUS_EXPRESSION_OPERATOR;
}

/* After "[". An operator waits while one of a higher rank follows: at most one waits in each rank. */
static enum status read_expression(struct reader *reader, double *value) {
    struct {
        double left;
        enum operation operation;
        unsigned rank;
    } waiting[RANK_COUNT]; /* their ranks rise, so there is room for all */
    unsigned count = 0;

    for (;;) {
        enum operation operation = OPERATOR_END;
        unsigned rank = 0;
        enum status status = read_value(reader, value);

        if (status == STATUS_OK)
            status = read_operator(reader, &operation, &rank);
        while (status == STATUS_OK && count > 0 && waiting[count - 1].rank >= rank) {
            count--;
            status = calculate(waiting[count].operation, *value, &waiting[count].left);
            *value = waiting[count].left;
        }
        if (status != STATUS_OK || operation == OPERATOR_END)
            return status;
        waiting[count].left = *value;
        waiting[count].operation = operation;
        waiting[count++].rank = rank;
    }
}

static enum status read_bracket(struct reader *reader, double *value) {
    return take(reader, "[") ? read_expression(reader, value) : STATUS_EXPRESSION_BRACKET;
}

static enum status read_name(struct reader *reader, struct param_ref *ref) {
    const char *end = strchr(reader->text, '>');

    if (end == NULL || end == reader->text || end - reader->text >= PARAMS_NAME_SIZE)
        return STATUS_PARAMETER_NAME;
    /* The name stays in the line; it is copied only when a parameter is set (params.c). */
    ref->name = reader->text;
    ref->length = (uint8_t)(end - reader->text);
    ref->number = 0;
    reader->text = end + 1;
    return STATUS_OK;
}

/* After "#". */
static enum status read_reference(struct reader *reader, struct param_ref *ref) {
    double number, whole;
    enum status status;

    if (take(reader, "<"))
        return read_name(reader, ref);
    status = read_value(reader, &number);
    if (status != STATUS_OK)
        return status;
    /* A computed number may be off by rounding, so #[0.1 * 30] is #3. */
    whole = floor(number + 0.5);
    if (fabs(number - whole) > TOLERANCE || whole < 1.0 || whole > UINT16_MAX)
        return STATUS_PARAMETER_NUMBER;
    ref->name = NULL;
    ref->length = 0;
    ref->number = (uint16_t)whole;
    return STATUS_OK;
}

static enum status read_parameter(struct reader *reader, double *value) {
    struct param_ref ref;
    const enum status status = read_reference(reader, &ref);

    return status == STATUS_OK ? readings_get(reader->context, &ref, value) : status;
}

/* EXISTS[#<name>]: a numbered one always does, and so does one whose value only the machine can know. */
static enum status read_exists(struct reader *reader, double *value) {
    struct param_ref ref;
    enum status status;

    if (!take(reader, "[#"))
        return STATUS_EXPRESSION_BRACKET;
    status = read_reference(reader, &ref);
    if (status != STATUS_OK)
        return status;
    if (!take(reader, "]"))
        return STATUS_EXPRESSION_BRACKET;
    status = readings_get(reader->context, &ref, value);
    *value = status == STATUS_OK || status == STATUS_MACHINE_ONLY;
    return STATUS_OK;
}

/* ATAN[y]/[x], the one function with two arguments. */
static enum status read_atan(struct reader *reader, double *value) {
    double x;
    enum status status = read_bracket(reader, value);

    if (status == STATUS_OK && !take(reader, "/"))
        return STATUS_EXPRESSION_BRACKET;
    if (status == STATUS_OK)
        status = read_bracket(reader, &x);
    if (status == STATUS_OK)
        *value = function_atan2_deg(*value, x);
    return status;
}

static enum status read_function(struct reader *reader, double *value) {
    if (take(reader, "ATAN"))
        return read_atan(reader, value);
    if (take(reader, "EXISTS"))
        return read_exists(reader, value);
    for (size_t i = 0; i < function_count; i++) {
        if (!take(reader, functions[i].name))
            continue;
        enum status status = read_bracket(reader, value);
        if (status == STATUS_OK)
            status = functions[i].call(*value, value);
        return status == STATUS_OK ? finite_or_error(*value) : status;
    }
    return STATUS_EXPRESSION_OPERATOR;
}

static bool is_number(const char *text) {
    return number_digit(*text) <= 9 || *text == '.';
}

static enum status read_number(struct reader *reader, double *value) {
    const char *end = number_read(reader->text, value);

    if (end == NULL)
        return STATUS_BAD_NUMBER;
    reader->text = end;
    return STATUS_OK;
}

/* A sign binds closer than every operator: -2**2 is 4. */
static enum status read_kind(struct reader *reader, double *value) {
    if (is_number(reader->text))
        return read_number(reader, value);
    if (take(reader, "["))
        return read_expression(reader, value);
    if (take(reader, "#"))
        return read_parameter(reader, value);
    if (take(reader, "+"))
        return read_value(reader, value);
    if (take(reader, "-")) {
        const enum status status = read_value(reader, value);
        *value = -*value;
        return status;
    }
    if (*reader->text >= 'A' && *reader->text <= 'Z')
        return read_function(reader, value);
    return STATUS_BAD_NUMBER;
}

/* All recursion comes through here, so that the depth bounds the stack that a hostile line can use. */
static enum status read_value(struct reader *reader, double *value) {
    enum status status;

    if (reader->depth == EXPRESSION_DEPTH_MAX)
        return STATUS_EXPRESSION_DEPTH;
    reader->depth++;
    *value = 0.0;
    status = read_kind(reader, value);
    reader->depth--;
    return status;
}

enum status expression_value(const struct param_context *context, const char **text, double *value) {
    struct reader reader = {.context = context, .text = *text};
    const enum status status = read_value(&reader, value);

    *text = reader.text;
    return status;
}

enum status expression_reference(const struct param_context *context, const char **text,
                                 struct param_ref *ref) {
    struct reader reader = {.context = context, .text = *text};
    const enum status status = read_reference(&reader, ref);

    *text = reader.text;
    return status;
}
