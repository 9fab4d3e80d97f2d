/* SPDX-License-Identifier: MIT
 * input/line_reader: buffers cut anywhere give the lines that single bytes give.
 *
 * The first byte seeds the sizes of the buffers; the rest is the stream. */
#include "fuzz.h"

#include "input/line_reader.h"

#include <string.h>

enum { CHUNK_MAX = 97 };

/* A buffer of exactly this size, so that a read past its end is seen. */
static uint8_t *copy(const uint8_t *bytes, size_t count) {
    uint8_t *exact = malloc(count > 0 ? count : 1);
    if (exact == NULL)
        abort();
    memcpy(exact, bytes, count);
    return exact;
}

static void check_line(const struct line_reader *reader, enum line_result result) {
    size_t length = strlen(reader->text);
    CLAIM(length < LINE_SIZE, "%zu characters stored", length);
    CLAIM(result != LINE_OVERFLOW || length == LINE_SIZE - 1, "overflow at %zu characters", length);
    bool formula = false;
    for (size_t n = 0; n < length; n++) {
        char c = reader->text[n];
        formula |= c == '[' || c == '#';
        CLAIM(c > ' ' && (c != '/' || formula) && c != '(' && c != ';' && !(c >= 'a' && c <= 'z'),
              "stored %d", c);
    }
}

/* One buffer through take(), the same bytes through put(). */
static void feed(struct line_reader *taker, struct line_reader *putter, const uint8_t *bytes, size_t count) {
    while (count > 0) {
        enum line_result by_take = LINE_NONE, by_put = LINE_NONE;
        size_t taken = line_reader_take(taker, bytes, count, &by_take);
        CLAIM(taken > 0 && taken <= count, "%zu of %zu bytes", taken, count);
        CLAIM(by_take != LINE_NONE || taken == count, "stopped at %zu of %zu", taken, count);
        for (size_t n = 0; n < taken; n++) {
            by_put = line_reader_put(putter, bytes[n]);
            CLAIM(by_put == LINE_NONE || n + 1 == taken, "take() ran over the end of a line");
        }
        CLAIM(by_put == by_take, "%d by bytes, %d by buffer", by_put, by_take);
        CLAIM(taker->length == putter->length && taker->flags == putter->flags, "states differ");
        CLAIM(memcmp(taker->text, putter->text, taker->length) == 0, "texts differ");
        if (by_take != LINE_NONE)
            check_line(taker, by_take);
        bytes += taken;
        count -= taken;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct input input = {data, data + size};
    struct line_reader taker, putter;
    uint32_t random = input_byte(&input) + 1u;
    memset(&taker, 0, sizeof taker);
    memset(&putter, 0, sizeof putter);
    line_reader_reset(&taker);
    line_reader_reset(&putter);
    while (input_left(&input) > 0) {
        random = random * 1664525u + 1013904223u;
        size_t count = (random >> 16) % CHUNK_MAX;
        count = count < input_left(&input) ? count : input_left(&input);
        uint8_t *chunk = copy(input.at, count);
        feed(&taker, &putter, chunk, count);
        free(chunk);
        input.at += count;
    }
    return 0;
}
