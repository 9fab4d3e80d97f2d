/* SPDX-License-Identifier: MIT */
#include "input/line_reader.h"

#include "input/text_byte.h"

#include <string.h> // memchr

/* Why characters are not simply stored right now. At most one of BROKEN and the first three at a time, as in
 * Grbl. */
enum {
    IN_PARENTHESES = 1,
    AFTER_SEMICOLON = 2,
    OVERFLOWED = 4,
    LINE_DONE = 8, /* text is the caller's until the next byte */
    AFTER_CR = 16, /* only with LINE_DONE */
    BROKEN = 32,
};

enum { LENGTH_MAX = LINE_SIZE - 1 };

/* What a byte is stored as, or one of these two. Bytes >= 0x80 are dropped. */
enum { DROP = 0, LOOK = 1 };

/* clang-format off */
static const uint8_t stored_as[256] = {
    DROP, DROP, DROP, DROP, DROP, DROP, DROP, DROP, DROP, DROP, LOOK, DROP, DROP, LOOK, DROP, DROP,
    DROP, DROP, DROP, DROP, DROP, DROP, DROP, DROP, LOOK, DROP, DROP, DROP, DROP, DROP, DROP, DROP,
    DROP, '!',  '"',  '#',  '$',  '%',  '&',  '\'', LOOK, ')',  '*',  '+',  ',',  '-',  '.',  LOOK,
    '0',  '1',  '2',  '3',  '4',  '5',  '6',  '7',  '8',  '9',  ':',  LOOK, '<',  '=',  '>',  '?',
    '@',  'A',  'B',  'C',  'D',  'E',  'F',  'G',  'H',  'I',  'J',  'K',  'L',  'M',  'N',  'O',
    'P',  'Q',  'R',  'S',  'T',  'U',  'V',  'W',  'X',  'Y',  'Z',  '[',  '\\', ']',  '^',  '_',
    '`',  'A',  'B',  'C',  'D',  'E',  'F',  'G',  'H',  'I',  'J',  'K',  'L',  'M',  'N',  'O',
    'P',  'Q',  'R',  'S',  'T',  'U',  'V',  'W',  'X',  'Y',  'Z',  '{',  '|',  '}',  '~',  0x7f,
};
/* clang-format on */

static void start_line(struct line_reader *reader) {
    reader->length = 0;
    reader->flags = 0;
    reader->commented = 0;
}

void line_reader_reset(struct line_reader *reader) {
    reader->text[0] = '\0';
    start_line(reader);
}

/* CR, LF and CR LF each end one line: an LF right after a CR is dropped, so that senders of either kind
 * get one answer per line. */
static enum line_result end_line(struct line_reader *reader, uint8_t byte) {
    const uint8_t flags = reader->flags;

    reader->text[reader->length] = '\0';
    reader->flags = byte == '\r' ? LINE_DONE | AFTER_CR : LINE_DONE;
    if (flags == BROKEN)
        return LINE_BROKEN;
    return flags == OVERFLOWED ? LINE_OVERFLOW : LINE_READY;
}

/* The first byte after a line. @return true if it was the LF of a CR LF */
static bool leave_line(struct line_reader *reader, uint8_t byte) {
    const bool second_half = (reader->flags & AFTER_CR) != 0 && byte == '\n';

    start_line(reader);
    return second_half;
}

static void store(struct line_reader *reader, char character) {
    if (reader->length < LENGTH_MAX)
        reader->text[reader->length++] = character;
    else
        reader->flags = OVERFLOWED;
}

/* A slash divides once the line has an expression; before, it is a block delete that is switched off. */
static void put_slash(struct line_reader *reader) {
    if (memchr(reader->text, '[', reader->length) != NULL ||
        memchr(reader->text, '#', reader->length) != NULL)
        store(reader, '/');
}

/* Any byte, once leave_line() has seen it. */
static enum line_result put(struct line_reader *reader, uint8_t byte) {
    const uint8_t character = stored_as[byte];

    if (byte == '\n' || byte == '\r')
        return end_line(reader, byte);
    if (byte == LINE_GAP) {
        reader->flags = BROKEN; /* the lost bytes may have ended a comment */
    } else if (reader->flags != 0) {
        /* Nothing is stored in a comment or after an overflow; a comment in parentheses ends with its
         * bracket, one after a semicolon only with the line. */
        if (byte == ')' && reader->flags == IN_PARENTHESES)
            reader->flags = 0;
        else if (byte >= ' ' && reader->commented < LINE_COMMENT_SIZE)
            reader->comment[reader->commented++] = (char)byte;
    } else if (byte == '/') {
        put_slash(reader);
    } else if (character == LOOK) {
        reader->flags = byte == '(' ? IN_PARENTHESES : AFTER_SEMICOLON;
    } else if (character != DROP) {
        store(reader, (char)character);
    }
    return LINE_NONE;
}

enum line_result line_reader_put(struct line_reader *reader, uint8_t byte) {
    if ((reader->flags & LINE_DONE) && leave_line(reader, byte))
        return LINE_NONE;
    return put(reader, byte);
}

/* Store and drop bytes while that is all they need. @return how many */
static size_t put_run(struct line_reader *reader, const uint8_t *bytes, size_t count) {
    const size_t room = LENGTH_MAX - (size_t)reader->length;
    char *text = reader->text + reader->length;
    size_t taken = 0;

    for (count = count < room ? count : room; taken < count; taken++) {
        const uint8_t character = stored_as[bytes[taken]];

        if (character > LOOK)
            *text++ = (char)character;
        else if (character == LOOK)
            break;
    }
    reader->length = (uint16_t)(text - reader->text);
    return taken;
}

size_t line_reader_take(struct line_reader *reader, const uint8_t *bytes, size_t count,
                        enum line_result *result) {
    size_t taken = 0;

    *result = LINE_NONE;
    if ((reader->flags & LINE_DONE) && count > 0)
        taken = leave_line(reader, bytes[0]);
    while (taken < count && *result == LINE_NONE) {
        if (reader->flags == 0)
            taken += put_run(reader, bytes + taken, count - taken);
        if (taken < count)
            *result = put(reader, bytes[taken++]);
    }
    return taken;
}

bool line_reader_is_between(const struct line_reader *reader) {
    return (reader->flags & LINE_DONE) != 0 || (reader->flags == 0 && reader->length == 0);
}

const uint8_t *line_reader_whole(const struct line_reader *reader, const uint8_t *bytes, size_t count) {
    const bool second_half = (reader->flags & AFTER_CR) != 0 && count > 0 && bytes[0] == '\n';

    if (!line_reader_is_between(reader))
        return NULL;
    bytes += second_half;
    count -= second_half;
    return memchr(bytes, '\n', count < LINE_SIZE ? count : LINE_SIZE) != NULL ? bytes : NULL;
}

void line_reader_pass(struct line_reader *reader, uint8_t end) {
    reader->flags = end == '\r' ? LINE_DONE | AFTER_CR : LINE_DONE;
    reader->commented = 0;
}

static char shown(char character) {
    if ((uint8_t)character == TEXT_LETTER)
        return '?';
    return character == '[' ? '(' : character == ']' ? ')' : character == '|' ? '/' : character;
}

/* The comma of MSG, PRINT, or DEBUG, at the beginning of the comments; NULL: it is none of these. */
static const char *message_mark(const char *from, const char *end) {
    static const char marks[][6] = {"MSG", "PRINT", "DEBUG"};
    while (from != end && *from == ' ')
        from++;
    for (unsigned i = 0; i < sizeof marks / sizeof marks[0]; i++) {
        const char *at = from, *mark = marks[i];
        while (at != end && *mark != '\0' && (*at & ~32) == *mark)
            at++, mark++;
        if (*mark == '\0' && at != end && *at == ',')
            return at;
    }
    return NULL;
}

bool line_reader_has_message(const struct line_reader *reader) {
    return message_mark(reader->comment, reader->comment + reader->commented) != NULL;
}

bool line_reader_has_values(const struct line_reader *reader) {
    const char *comma = message_mark(reader->comment, reader->comment + reader->commented);
    return comma != NULL && (comma[-2] & ~32) != 'S'; /* of MSG */
}

bool line_reader_comment(const struct line_reader *reader, char *text, size_t size) {
    const char *from = reader->comment;
    const char *end = from + reader->commented;
    const bool is_given = from != end;
    const char *mark = message_mark(from, end);
    size_t count = 0;
    if (mark != NULL)
        from = mark + 1;
    while (from != end && *from == ' ')
        from++;
    while (from != end && end[-1] == ' ')
        end--;
    for (; from != end && count + 1 < size; from++)
        text[count++] = shown(*from);
    text[count] = '\0';
    return is_given;
}
