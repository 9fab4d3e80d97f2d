/* SPDX-License-Identifier: MIT
 * Step events -> CSV: t_ns,step_mask,dir_mask,duty. */
#include "trace_write.h"

#include <string.h>

static const char header[] = "t_ns,step_mask,dir_mask,duty\n";
enum { ROW = 20 + 1 + 3 + 1 + 3 + 1 + 5 + 1 };

static void consume(void *ctx, const struct trace_event *events, size_t count) {
    struct trace_writer *writer = ctx;
    if (writer->error != 0)
        return;
    for (size_t i = 0; i < count; i++) {
        char *p = trace_writer_room(writer, ROW);
        p = trace_put_u64(p, trace_ns(writer, events[i].t_ticks));
        *p++ = ',';
        p = trace_put_u64(p, events[i].step_mask);
        *p++ = ',';
        p = trace_put_u64(p, events[i].dir_mask);
        *p++ = ',';
        p = trace_put_u64(p, writer->duty);
        *p++ = '\n';
        trace_writer_keep(writer, p);
    }
}

struct trace_writer *trace_csv_open(const char *path, uint32_t timer_hz, int *error) {
    struct trace_writer *writer = trace_writer_open(path, timer_hz, consume, error);
    if (writer == NULL)
        return NULL;
    char *p = trace_writer_room(writer, sizeof header - 1);
    memcpy(p, header, sizeof header - 1);
    trace_writer_keep(writer, p + sizeof header - 1);
    return writer;
}
