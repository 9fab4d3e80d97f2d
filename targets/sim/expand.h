/* SPDX-License-Identifier: MIT
 * A program with O words, expressions and parameters -> the plain lines that it executes, each with the
 * number of the line it came from: program.h reads, the core computes (gcode/formula.h); nothing moves.
 *
 * What a program reads of the machine (its position, offsets, modes, a probe's result) is not known here
 * unless it was set before (knowledge.h): then it is refused with STATUS_MACHINE_ONLY.
 *
 * Called from one thread; Python drives it through ctypes. */
#ifndef WIFICNC_SIM_EXPAND_H
#define WIFICNC_SIM_EXPAND_H

#include "program_end.h"

#include <stddef.h>
#include <stdint.h>

struct expand;

/** Where the program begins. */
enum expand_start {
    EXPAND_ANYWHERE, /* nothing is known of the machine */
    EXPAND_AT_ZERO,  /* power-on: position 0, no offsets, G21 G90 G17 ...; a probe's result is not known */
};

/** Expand a program. A line that the controller will refuse is in the result unchanged: the controller
 * says so better.
 *  @param lines_max  so many lines may be executed, against endless loops
 *  @return NULL when memory is short; else look at expand_error() first */
struct expand *expand_create(const char *text, size_t size, enum expand_start start, uint32_t lines_max);
void expand_destroy(struct expand *expand);

/** 0, or the number of the error (gcode/status.h) that ended the program; the lines before it are there. */
int expand_error(const struct expand *expand);

/** Line of the file, 1-based, in which the error is. */
uint32_t expand_error_line(const struct expand *expand);

/** The plain lines, each with its LF, of at most LINE_SIZE - 1 characters; *size bytes. One that has only a
 * comment for the operator is empty. */
const char *expand_text(const struct expand *expand, size_t *size);

/** The comments of each of these lines, each line with its LF: in their brackets or behind their semicolon,
 * as in the text, but in PRINT and DEBUG with values in place of parameters; *size bytes. */
const char *expand_comments(const struct expand *expand, size_t *size);

/** Number of lines, and of each of them where in the file it came from. */
size_t expand_lines(const struct expand *expand, const uint32_t **numbers);

/** What of the file is not run (program_note_end()); good until expand_destroy(). */
const struct program_end *expand_end(const struct expand *expand);

/** The text has an O line: it must be expanded to be streamed. */
int expand_is_needed(const char *text, size_t size);

#endif
