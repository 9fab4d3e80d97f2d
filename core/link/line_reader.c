/* SPDX-License-Identifier: MIT */
#include "link/line_reader.h"

/* Why characters are not stored right now; at most one of the first three at a time, as in Grbl. */
enum {
    IN_PARENTHESES = 1,
    AFTER_SEMICOLON = 2,
    OVERFLOWED = 4,
    LINE_DONE = 8, /* text is the caller's until this byte */
    AFTER_CR = 16,
};

void line_reader_reset(struct line_reader *reader) {
    reader->text[0] = '\0';
    reader->length = 0;
    reader->flags = 0;
}

static enum line_result end_line(struct line_reader *reader, uint8_t byte) {
    const bool overflowed = (reader->flags & OVERFLOWED) != 0;

    reader->text[reader->length] = '\0';
    reader->flags = byte == '\r' ? LINE_DONE | AFTER_CR : LINE_DONE;
    return overflowed ? LINE_OVERFLOW : LINE_READY;
}

/* A byte while some flag is set. @return true when it is to be looked at as the first byte of a new line */
static bool wake(struct line_reader *reader, uint8_t byte) {
    if (reader->flags & LINE_DONE) {
        const bool second_half = (reader->flags & AFTER_CR) != 0 && byte == '\n';

        reader->flags = 0;
        reader->length = 0;
        return !second_half;
    }
    if (byte == ')' && reader->flags == IN_PARENTHESES)
        reader->flags = 0;
    return byte == '\n' || byte == '\r';
}

enum line_result line_reader_put(struct line_reader *reader, uint8_t byte) {
    if (reader->flags != 0 && !wake(reader, byte))
        return LINE_NONE;
    if (byte <= ' ') {
        return byte == '\n' || byte == '\r' ? end_line(reader, byte) : LINE_NONE;
    }
    if (byte == '/' || byte == '(' || byte == ';') {
        if (byte != '/')
            reader->flags = byte == '(' ? IN_PARENTHESES : AFTER_SEMICOLON;
        return LINE_NONE;
    }
    if (reader->length >= LINE_SIZE - 1) {
        reader->flags = OVERFLOWED;
        return LINE_NONE;
    }
    if (byte >= 'a' && byte <= 'z')
        byte = (uint8_t)(byte - ('a' - 'A'));
    reader->text[reader->length++] = (char)byte;
    return LINE_NONE;
}
