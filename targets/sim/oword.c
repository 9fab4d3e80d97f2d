/* SPDX-License-Identifier: MIT */
#include "oword.h"

#include "gcode/block.h"
#include "gcode/expression.h"
#include "gcode/number.h"

#include <string.h>

/* No keyword begins with one that comes before it, so the first that fits is the right one: ELSEIF
 * comes before ELSE. */
static const struct {
    const char *text;
    enum oword_kind kind;
} keywords[] = {
    {"SUB", OWORD_SUB},
    {"ENDSUB", OWORD_ENDSUB},
    {"CALL", OWORD_CALL},
    {"RETURN", OWORD_RETURN},
    {"IF", OWORD_IF},
    {"ELSEIF", OWORD_ELSEIF},
    {"ELSE", OWORD_ELSE},
    {"ENDIF", OWORD_ENDIF},
    {"WHILE", OWORD_WHILE},
    {"ENDWHILE", OWORD_ENDWHILE},
    {"DO", OWORD_DO},
    {"REPEAT", OWORD_REPEAT},
    {"ENDREPEAT", OWORD_ENDREPEAT},
    {"BREAK", OWORD_BREAK},
    {"CONTINUE", OWORD_CONTINUE},
};

static void put_number(struct program_label *label, uint32_t number) {
    char digits[12], *at = digits + sizeof digits - 1;

    *at = '\0';
    do {
        *--at = (char)('0' + number % 10);
        number /= 10;
    } while (number != 0);
    strcpy(label->text, at);
}

static enum status read_name(const char **text, struct program_label *label) {
    const char *end = strchr(*text, '>');
    const size_t length = end != NULL ? (size_t)(end - *text) : 0;

    if (length == 0 || length >= PROGRAM_LABEL_SIZE)
        return STATUS_O_WORD_SYNTAX;
    memcpy(label->text, *text, length);
    label->text[length] = '\0';
    *text = end + 1;
    return STATUS_OK;
}

static enum status read_digits(const char **text, struct program_label *label) {
    uint32_t number = 0;

    for (; number_digit(**text) <= 9; ++*text) {
        if (number > UINT32_MAX / 10 - 1)
            return STATUS_O_WORD_SYNTAX;
        number = number * 10 + number_digit(**text);
    }
    put_number(label, number);
    return STATUS_OK;
}

/* After "#" or "[": skip what cannot be computed yet up to its keyword. */
static void skip_computed(const char **text) {
    unsigned depth = 0;

    for (; **text != '\0'; ++*text) {
        depth += **text == '[' || **text == '<';
        depth -= depth > 0 && (**text == ']' || **text == '>');
        if (depth == 0 && (*text)[1] >= 'A' && (*text)[1] <= 'Z')
            break;
    }
    *text += **text != '\0';
}

static enum status read_computed(const struct param_context *context, const char **text,
                                 struct program_label *label) {
    double value;
    enum status status;

    label->text[0] = '\0';
    if (context == NULL) {
        skip_computed(text);
        return STATUS_OK;
    }
    status = expression_value(context, text, &value);
    if (status != STATUS_OK)
        return status;
    if (value < 0.0 || value >= 1e9 || value != (double)(uint32_t)value)
        return STATUS_O_WORD_SYNTAX;
    put_number(label, (uint32_t)value);
    return STATUS_OK;
}

static enum status read_label(const struct param_context *context, const char **text,
                              struct program_label *label) {
    if (**text == '<') {
        ++*text;
        return read_name(text, label);
    }
    if (number_digit(**text) <= 9)
        return read_digits(text, label);
    if (**text == '#' || **text == '[')
        return read_computed(context, text, label);
    return STATUS_O_WORD_SYNTAX;
}

static bool has_values(enum oword_kind kind) {
    switch (kind) {
    case OWORD_CALL:
    case OWORD_RETURN:
    case OWORD_ENDSUB:
    case OWORD_IF:
    case OWORD_ELSEIF:
    case OWORD_WHILE:
    case OWORD_REPEAT:
        return true;
    default:
        return false;
    }
}

enum status oword_read(const struct param_context *context, const char *line, struct oword *out) {
    enum status status;
    bool computed;

    out->kind = OWORD_NONE;
    if (gcode_is_program_mark(line))
        return STATUS_OK; /* the number of the program */
    if (*line == 'N') {
        for (line++; number_digit(*line) <= 9; line++)
            ;
    }
    if (*line != 'O')
        return STATUS_OK;
    line++;
    computed = *line == '#' || *line == '[';
    status = read_label(context, &line, &out->label);
    for (size_t i = 0; status == STATUS_OK && i < sizeof keywords / sizeof keywords[0]; i++) {
        const size_t length = strlen(keywords[i].text);

        if (strncmp(line, keywords[i].text, length) != 0)
            continue;
        out->values = line + length;
        if (*out->values != '\0' && (*out->values != '[' || !has_values(keywords[i].kind)))
            continue;
        if (computed && keywords[i].kind != OWORD_CALL)
            return STATUS_O_WORD_SYNTAX; /* its other half could not be found */
        out->kind = keywords[i].kind;
        return STATUS_OK;
    }
    return status == STATUS_OK ? STATUS_O_WORD_SYNTAX : status;
}

enum status oword_value(const struct param_context *context, const struct oword *oword, bool *given,
                        double *value) {
    const char *text = oword->values;
    enum status status;

    *value = 0.0;
    *given = *text == '[';
    if (!*given)
        return STATUS_OK;
    status = expression_value(context, &text, value);
    return status == STATUS_OK && *text != '\0' ? STATUS_O_WORD_SYNTAX : status;
}

enum status oword_arguments(const struct param_context *context, const struct oword *oword,
                            double arguments[PARAMS_LOCAL]) {
    const char *text = oword->values;

    for (unsigned i = 0; i < PARAMS_LOCAL; i++)
        arguments[i] = 0.0;
    for (unsigned i = 0; *text != '\0'; i++) {
        enum status status;

        if (i == PARAMS_LOCAL || *text != '[')
            return STATUS_O_WORD_SYNTAX;
        status = expression_value(context, &text, &arguments[i]);
        if (status != STATUS_OK)
            return status;
    }
    return STATUS_OK;
}
