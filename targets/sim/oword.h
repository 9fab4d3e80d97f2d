/* SPDX-License-Identifier: MIT
 * One O line, taken apart. [task] Pure. Private to core/gcode. */
#ifndef WIFICNC_SIM_OWORD_H
#define WIFICNC_SIM_OWORD_H

#include "program.h"

enum oword_kind {
    OWORD_NONE, /* the line has no O word, or but the number of the program */
    OWORD_SUB,
    OWORD_ENDSUB,
    OWORD_CALL,
    OWORD_RETURN,
    OWORD_IF,
    OWORD_ELSEIF,
    OWORD_ELSE,
    OWORD_ENDIF,
    OWORD_WHILE,
    OWORD_ENDWHILE,
    OWORD_DO,
    OWORD_REPEAT,
    OWORD_ENDREPEAT,
    OWORD_BREAK,
    OWORD_CONTINUE,
    OWORD_COUNT
};

struct oword {
    enum oword_kind kind;
    struct program_label label;
    const char *values; /* what follows the keyword, inside the line */
};

/** Take a filtered line apart.
 *  @param context  NULL: a label that is computed (o#1 call) is left empty
 *  @return STATUS_OK, also for OWORD_NONE; STATUS_O_WORD_SYNTAX, and what the label's expression may give */
enum status oword_read(const struct param_context *context, const char *line, struct oword *out);

/** The one value behind the keyword, or *given = false and 0. Nothing may follow it. */
enum status oword_value(const struct param_context *context, const struct oword *oword, bool *given,
                        double *value);

/** The values of a call. @return STATUS_O_WORD_SYNTAX: more than PARAMS_LOCAL, or no [values] */
enum status oword_arguments(const struct param_context *context, const struct oword *oword,
                            double arguments[PARAMS_LOCAL]);

static inline bool oword_same(const struct program_label *a, const struct program_label *b) {
    const char *x = a->text, *y = b->text;

    for (; *x != '\0' && *x == *y; x++, y++)
        ;
    return *x == *y;
}

#endif
