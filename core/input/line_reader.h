/* SPDX-License-Identifier: MIT
 * Bytes -> filtered lines, with Grbl's character rules. [task] One reader per stream; no allocation.
 *
 * Stored: printable characters above space, upper-cased. Dropped: characters <= space but LINE_GAP,
 * everything in ( ) and everything after ';' (some of it is kept as the comment), bytes >= 0x80, and '/'
 * unless the line has a '[' or '#' before it (there it divides). Real-time bytes never get here: input/rx.h
 * takes them out first. A line ends at LF or CR; CR LF is one end. An empty line is a line (it is answered
 * with ok). */
#ifndef WIFICNC_INPUT_LINE_READER_H
#define WIFICNC_INPUT_LINE_READER_H

#include "config.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum line_result {
    LINE_NONE,     /* no line yet */
    LINE_READY,    /* reader->text holds a line; it stays until the next byte is taken */
    LINE_OVERFLOW, /* a line ended that had LINE_SIZE or more stored characters: answer error:11 */
    LINE_BROKEN,   /* a line ended of which bytes were lost on the way (LINE_GAP): answer error:11 */
};

/** In the place of bytes that were lost on the way. No stream brings it: it is Ctrl-X, which rx_put() takes
 * out.
 */
enum { LINE_GAP = 0x18 };

struct line_reader {
    char text[LINE_SIZE];            /* NUL-terminated when LINE_READY */
    uint16_t length;                 /* stored characters */
    uint8_t flags;                   /* private: in ( ), after ;, overflow, line done, after CR */
    uint8_t commented;               /* characters of the comment */
    char comment[LINE_COMMENT_SIZE]; /* the beginning of the line's comments, as they came; no NUL */
};

/** Empty the reader; a half line is forgotten. */
void line_reader_reset(struct line_reader *reader);

/** Take one byte. */
enum line_result line_reader_put(struct line_reader *reader, uint8_t byte);

/** Take bytes up to and including the next end of a line: line_reader_put() for a buffer, at a third of its
 * cost.
 *  @return how many bytes were taken: all count of them when *result is LINE_NONE */
size_t line_reader_take(struct line_reader *reader, const uint8_t *bytes, size_t count,
                        enum line_result *result);

/** The line's comment begins with MSG, PRINT, or DEBUG, (LinuxCNC, grblHAL): it is meant for the operator. */
bool line_reader_has_message(const struct line_reader *reader);

/** That beginning is PRINT, or DEBUG,: values take the place of parameters in it. */
bool line_reader_has_values(const struct line_reader *reader);

/** The comment of the line, as messages show it: without blanks at its ends, and without such a beginning;
 * the marks of a report are others.
 *  @return false: it has none, and text is "". A comment of blanks is one, and "", too */
bool line_reader_comment(const struct line_reader *reader, char *text, size_t size);

/** Nothing of a line was taken since the last one ended. */
bool line_reader_is_between(const struct line_reader *reader);

/** A whole line at bytes of which nothing was taken yet, for someone who can do without the filter. An LF
 * that is the second half of a CR LF before it does not count.
 *  @return its first byte, with an LF less than LINE_SIZE behind it; NULL: there is no such line, take it */
const uint8_t *line_reader_whole(const struct line_reader *reader, const uint8_t *bytes, size_t count);

/** The line from line_reader_whole() was taken without us, up to and including its end, CR or LF. */
void line_reader_pass(struct line_reader *reader, uint8_t end);

#endif
