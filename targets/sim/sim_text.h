/* SPDX-License-Identifier: MIT
 * A job file as a sender puts it on the wire: one LF per line, and nothing that would act before its turn.
 *
 * - A line ends with LF, CR or CR LF; the last one may lack its end. A leading UTF-8 mark and a trailing
 * Ctrl-Z go.
 * - Lines that begin with % are marks for the sender (tape start and end) and are not sent.
 * - The program ends at M2, M30 or its closing % (program_end.h): what follows is not sent.
 * - Real-time bytes (! ? ~ 0x18 and all above 0x7F: they act immediately, wherever they are) and control
 * characters are left out of comments. In code they cannot be meant: each becomes a ", which the controller
 * refuses as it should
 *   ("G1 X1<garbage>0" must not turn into X10). */
#ifndef WIFICNC_SIM_SIM_TEXT_H
#define WIFICNC_SIM_SIM_TEXT_H

#include "expand.h"
#include "program_end.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct sim_text {
    char *bytes; /* lines, each with its LF */
    size_t size;
    uint32_t *line_number; /* of each line, 1-based in the file */
    uint64_t line_count;
    uint64_t file_lines; /* in the file, with the skipped ones */
    uint64_t percent_lines;
    struct program_end end;
};

/** @return 0, or -1 when memory is short. Free it with sim_text_free(). */
int sim_text_make(struct sim_text *out, const char *text, size_t size);
/** Of the lines that a program executes, each with its comments. @return as above */
int sim_text_make_expanded(struct sim_text *out, const struct expand *expand);
void sim_text_free(struct sim_text *text);

/** A blank, tab or form feed: a controller leaves it out. */
bool sim_text_is_blank(char c);

#endif
