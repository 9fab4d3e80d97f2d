/* SPDX-License-Identifier: MIT
 * A comment for the operator. In PRINT and DEBUG values take the place of parameters, as in LinuxCNC: #5220,
 * #<name>, and from a %d, %f, %.2f or %lf on with so many decimals. */
#include "machine/comment.h"

#include "machine/parts.h"
#include "machine/report.h"

#include <math.h>
#include <string.h>

enum { DECIMALS_OF_F = 4, DECIMALS_OF_LF = 6 };

static bool is_digit(char character) {
    return character >= '0' && character <= '9';
}

/* Moves *text past a format. @return false: it is none */
static bool read_format(const char **text, unsigned *decimals) {
    const char *at = *text + 1;
    if (*at == '.' && is_digit(at[1]) && at[2] == 'f') {
        *decimals = at[1] < '0' + DECIMALS_OF_LF ? (unsigned)(at[1] - '0') : DECIMALS_OF_LF;
        at += 2;
    } else if (*at == 'd' || *at == 'f') {
        *decimals = *at == 'd' ? 0 : DECIMALS_OF_F;
    } else if (*at == 'l' && at[1] == 'f') {
        *decimals = DECIMALS_OF_LF;
        at++;
    } else {
        return false;
    }
    *text = at + 1;
    return true;
}

/* As the filter of lines makes it: without blanks, upper case. @param at  behind the < */
static const char *read_name(const char *at, char name[PARAMS_NAME_SIZE], struct param_ref *ref) {
    for (; *at != '>'; at++) {
        if (*at == '\0' || ref->length == PARAMS_NAME_SIZE - 1)
            return NULL;
        if (*at != ' ')
            name[ref->length++] = (char)(*at >= 'a' && *at <= 'z' ? *at - 'a' + 'A' : *at);
    }
    ref->name = name;
    return ref->length > 0 ? at + 1 : NULL;
}

/* Moves *text past a reference. @return false: it is none */
static bool read_reference(const char **text, char name[PARAMS_NAME_SIZE], struct param_ref *ref) {
    const char *at = *text + 1;
    *ref = (struct param_ref){.name = NULL};
    if (*at == '<') {
        at = read_name(at + 1, name, ref);
        if (at == NULL)
            return false;
    } else {
        unsigned number = 0;
        for (; is_digit(*at); at++)
            number = number < UINT16_MAX ? 10 * number + (unsigned)(*at - '0') : number;
        if (number == 0)
            return false;
        ref->number = (uint16_t)(number < UINT16_MAX ? number : UINT16_MAX); /* which does not exist */
    }
    *text = at;
    return true;
}

/* @param text  the reference, `length` characters */
static void print_value(const struct text_out *out, const struct param_context *context,
                        const struct param_ref *ref, unsigned decimals, const char *text, size_t length) {
    double value;
    const enum status status = readings_get(context, ref, &value);
    if (status == STATUS_OK && fabs(value) < 1e12)
        text_fixed(out, value, decimals);
    else if (status == STATUS_MACHINE_ONLY)
        out->write(out->ctx, text, length);
    else
        text_string(out, "######");
}

void comment_print(const struct text_out *out, const struct param_context *context, const char *text) {
    unsigned decimals = DECIMALS_OF_LF;
    while (*text != '\0') {
        char name[PARAMS_NAME_SIZE];
        struct param_ref ref;
        const char *from = text;
        if (*text == '%' && read_format(&text, &decimals))
            continue;
        if (*text == '#' && read_reference(&text, name, &ref)) {
            print_value(out, context, &ref, decimals, from, (size_t)(text - from));
            continue;
        }
        const size_t plain = 1 + strcspn(text + 1, "#%");
        out->write(out->ctx, text, plain);
        text += plain;
    }
}

void report_line_comment(struct machine *machine) {
    char text[LINE_COMMENT_SIZE + 1];
    if (!line_reader_comment(&machine->lines.reader, text, sizeof text) || text[0] == '\0')
        return;
    if (!line_reader_has_values(&machine->lines.reader)) {
        report_message(machine, text);
        return;
    }
    const struct param_context context = {
        .gcode = &machine->interp.gcode, .params = &machine->interp.params, .line = machine->lines.count};
    text_string(&machine->out, "[MSG:");
    comment_print(&machine->out, &context, text);
    text_string(&machine->out, "]\r\n");
}
