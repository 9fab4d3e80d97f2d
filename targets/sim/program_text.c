/* SPDX-License-Identifier: MIT */
#include "program_text.h"

#include "input/line_reader.h"
#include "input/text_byte.h"

/* What is left out at the moment; the rules of input/line_reader.c. */
enum skipping { SKIP_NOTHING, SKIP_PARENTHESES, SKIP_REST };

struct filter {
    enum skipping skipping;
    bool formula, too_long; /* formula: the line has # or [, so that a slash divides */
    unsigned length;
};

static const int end_of_text = -1, read_error = -2;

/* The byte at an offset, or end_of_text, or read_error. */
static int byte_at(struct program *program, uint32_t offset) {
    if (offset - program->chunk_offset >= program->chunk_count) {
        const int32_t count =
            program->source.read(program->source.ctx, offset, program->chunk, PROGRAM_CHUNK_SIZE);

        program->chunk_offset = offset;
        program->chunk_count = count > 0 ? (uint32_t)count : 0;
        if (count <= 0)
            return count == 0 ? end_of_text : read_error;
    }
    return (unsigned char)program->chunk[offset - program->chunk_offset];
}

static void store(struct program *program, struct filter *filter, char character) {
    if (filter->length + 1u == PROGRAM_LINE_SIZE) {
        filter->too_long = true;
        return;
    }
    filter->formula |= character == '#' || character == '[';
    program->text[filter->length++] = character;
}

static void take(struct program *program, struct filter *filter, char character) {
    if (filter->skipping == SKIP_REST)
        return;
    if (filter->skipping == SKIP_PARENTHESES) {
        if (character == ')')
            filter->skipping = SKIP_NOTHING;
    } else if (character == '(') {
        filter->skipping = SKIP_PARENTHESES;
    } else if (character == ';') {
        filter->skipping = SKIP_REST;
    } else if (character > ' ' && (character != '/' || filter->formula)) {
        const bool small = character >= 'a' && character <= 'z';
        store(program, filter, small ? (char)(character - 'a' + 'A') : character);
    }
}

/* After a line end; CR LF is one. */
static void end_line(struct program *program, int byte) {
    program->line = program->next.line++;
    program->next.offset++;
    if (byte == '\r' && byte_at(program, program->next.offset) == '\n')
        program->next.offset++;
}

enum status program_read_line(struct program *program, bool *more) {
    struct filter filter = {.skipping = SKIP_NOTHING};
    struct line_reader reader;
    int byte = program->next.offset < program->end ? byte_at(program, program->next.offset) : end_of_text;
    uint8_t left = 0;

    *more = byte != end_of_text;
    program->at = program->next;
    line_reader_reset(&reader);
    for (; byte >= 0 && byte != '\n' && byte != '\r'; byte = byte_at(program, program->next.offset)) {
        uint8_t code = (uint8_t)byte;
        if (text_byte(&left, &code))
            take(program, &filter, code < 0x80 ? (char)code : TEXT_LETTER);
        (void)line_reader_put(&reader, (uint8_t)byte);
        program->next.offset++;
    }
    program->has_message = line_reader_has_message(&reader);
    program->has_values = line_reader_has_values(&reader);
    program->text[filter.length] = '\0';
    if (*more)
        end_line(program, byte);
    if (byte == read_error)
        return STATUS_PROGRAM_READ;
    if (program->text[0] == '%' && program->text[1] != '\0') { /* a mark of who wrote the file */
        program->text[0] = '\0';
        return STATUS_OK;
    }
    return filter.too_long ? STATUS_LINE_TOO_LONG : STATUS_OK;
}
