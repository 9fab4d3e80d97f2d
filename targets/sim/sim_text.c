/* SPDX-License-Identifier: MIT
 * Job file -> lines for the wire. The rules are in sim_text.h. */
#include "sim_text.h"

#include "input/line_reader.h"

#include <stdlib.h>
#include <string.h>

enum { CTRL_X = 0x18, CTRL_Z = 0x1A, DELETE = 0x7F, REFUSED = '"' };

static const char utf8_mark[] = "\xEF\xBB\xBF";

/* Where a line of the file ends, and where the next one begins. */
static const char *line_end(const char *line, const char *end, const char **next) {
    const char *p = line;
    while (p < end && *p != '\n' && *p != '\r')
        p++;
    *next = p;
    if (p < end)
        *next = p + (end - p >= 2 && p[0] == '\r' && p[1] == '\n' ? 2 : 1);
    return p;
}

bool sim_text_is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}

static bool is_percent_line(const char *line, const char *end) {
    while (line < end && sim_text_is_blank(*line))
        line++;
    return line < end && *line == '%';
}

static bool is_harmless(unsigned char c) {
    if (sim_text_is_blank((char)c))
        return true;
    return c >= ' ' && c < DELETE && c != '!' && c != '?' && c != '~';
}

/* Bytes that a controller would take as real-time commands must not act: in a comment they are left out,
 * elsewhere they become a character that it refuses, so that the line is an error and not another line. */
static char *put_line(char *out, const char *line, const char *end) {
    bool in_brackets = false, in_tail = false;
    for (; line < end; line++) {
        bool in_comment = in_brackets || in_tail;
        if (is_harmless((unsigned char)*line))
            *out++ = *line;
        else if (!in_comment)
            *out++ = REFUSED;
        if (*line == ';' && !in_brackets)
            in_tail = true;
        else if (*line == '(' && !in_tail)
            in_brackets = true;
        else if (*line == ')')
            in_brackets = false;
    }
    *out++ = '\n';
    return out;
}

/* @return whether the line belongs to the program */
static bool take_line(struct sim_text *text, const char *line, const char *end, uint32_t number) {
    struct line_reader reader;
    enum line_result result;
    line_reader_reset(&reader);
    (void)line_reader_take(&reader, (const uint8_t *)line, (size_t)(end - line), &result);
    (void)line_reader_put(&reader, '\n');
    /* Text after a % is a mark of who wrote the file, and asks for nothing. */
    const bool is_text = reader.text[0] == '%' && reader.text[1] != '\0';
    return program_end_take(&text->end, is_text ? "" : reader.text, number);
}

static uint64_t count_ends(const char *text, const char *end) {
    uint64_t lines = 0;
    while (text < end) {
        line_end(text, end, &text);
        lines++;
    }
    return lines;
}

int sim_text_make(struct sim_text *out, const char *text, size_t size) {
    const char *end = text + size;
    /* Editors of Windows begin a file so, and those of DOS end it with Ctrl-Z; neither is a part of the
     * program. */
    if (size >= 3 && memcmp(text, utf8_mark, 3) == 0)
        text += 3;
    while (end > text && end[-1] == CTRL_Z)
        end--;
    *out = (struct sim_text){.file_lines = count_ends(text, end)};
    out->bytes = malloc((size_t)(end - text) + 1);
    out->line_number = malloc((size_t)(out->file_lines + 1) * sizeof *out->line_number);
    if (out->bytes == NULL || out->line_number == NULL) {
        sim_text_free(out);
        return -1;
    }
    char *p = out->bytes;
    for (uint32_t number = 1; text < end; number++) {
        const char *line = text;
        const char *stop = line_end(line, end, &text);
        const bool runs = take_line(out, line, stop, number);
        if (is_percent_line(line, stop)) {
            out->percent_lines++;
            continue;
        }
        if (!runs)
            continue;
        p = put_line(p, line, stop);
        out->line_number[out->line_count++] = number;
    }
    out->size = (size_t)(p - out->bytes);
    return 0;
}

/* Copies a line up to its LF. @return behind the LF */
static const char *copy_line(char **to, const char *line) {
    while (*line != '\n')
        *(*to)++ = *line++;
    return line + 1;
}

int sim_text_make_expanded(struct sim_text *out, const struct expand *expand) {
    size_t size, commented;
    const uint32_t *numbers;
    const char *plain = expand_text(expand, &size), *comments = expand_comments(expand, &commented);
    char *text = malloc(size + commented + 1), *end = text;
    if (text == NULL)
        return -1;
    for (size_t left = expand_lines(expand, &numbers); left > 0; left--) {
        plain = copy_line(&end, plain);
        comments = copy_line(&end, comments);
        *end++ = '\n';
    }
    const int failed = sim_text_make(out, text, (size_t)(end - text));
    free(text);
    for (uint64_t i = 0; failed == 0 && i < out->line_count; i++)
        out->line_number[i] = numbers[out->line_number[i] - 1];
    return failed;
}

void sim_text_free(struct sim_text *text) {
    free(text->bytes);
    free(text->line_number);
    *text = (struct sim_text){0};
}
