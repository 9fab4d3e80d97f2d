/* SPDX-License-Identifier: MIT
 * The part that all trace files share: the buffer, the file, its errors, and numbers. */
#include "trace_write.h"

#include "port_file.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static void flush(struct trace_writer *writer) {
    if (writer->error == 0 && writer->used > 0) {
        errno = 0;
        if (fwrite(writer->buffer, 1, writer->used, writer->file) != writer->used)
            writer->error = errno != 0 ? errno : EIO;
    }
    writer->used = 0;
}

/* What events that come have. */
static void note_duty(void *ctx, uint64_t t_ticks, uint16_t duty) {
    struct trace_writer *writer = ctx;
    (void)t_ticks;
    writer->duty = duty;
}

struct trace_writer *trace_writer_open(const char *path, uint32_t timer_hz, trace_consumer *consume,
                                       int *error) {
    struct trace_writer *writer = calloc(1, sizeof *writer);
    if (writer == NULL) {
        *error = ENOMEM;
        return NULL;
    }
    writer->file = port_open(path, "wb");
    if (writer->file == NULL) {
        *error = errno != 0 ? errno : EIO;
        free(writer);
        return NULL;
    }
    setvbuf(writer->file, NULL, _IONBF, 0); /* the buffer is ours */
    writer->consume = consume;
    writer->follow = note_duty;
    writer->timer_hz = timer_hz;
    writer->ns_per_tick = 1000000000u % timer_hz == 0 ? 1000000000u / timer_hz : 0;
    *error = 0;
    return writer;
}

bool trace_writer_attach(struct trace_writer *writer, struct trace *trace) {
    if (!trace_add(trace, writer->consume, writer))
        return false;
    trace_add_duty(trace, writer->follow);
    return true;
}

/* The caller writes directly into the buffer: a trace has a line for each step event. */
char *trace_writer_room(struct trace_writer *writer, size_t size) {
    if (TRACE_BUFFER - writer->used < size)
        flush(writer);
    return writer->buffer + writer->used;
}

int trace_writer_close(struct trace_writer *writer) {
    if (writer == NULL)
        return 0;
    if (writer->finish != NULL)
        writer->finish(writer);
    flush(writer);
    errno = 0;
    int failed = fclose(writer->file) != 0;
    int error = writer->error;
    if (error == 0 && failed)
        error = errno != 0 ? errno : EIO;
    free(writer);
    return error;
}

static const char digit_pairs[] = "00010203040506070809101112131415161718192021222324"
                                  "25262728293031323334353637383940414243444546474849"
                                  "50515253545556575859606162636465666768697071727374"
                                  "75767778798081828384858687888990919293949596979899";

char *trace_put_u64(char *p, uint64_t value) {
    char digits[20];
    char *first = digits + sizeof digits;
    while (value >= 100) {
        uint64_t rest = value / 100;
        first -= 2;
        memcpy(first, digit_pairs + (value - rest * 100) * 2, 2);
        value = rest;
    }
    if (value >= 10) {
        first -= 2;
        memcpy(first, digit_pairs + value * 2, 2);
    } else {
        *--first = (char)('0' + value);
    }
    size_t count = (size_t)(digits + sizeof digits - first);
    memcpy(p, first, count);
    return p + count;
}
