/* SPDX-License-Identifier: MIT
 * Step events -> CSV: t_ns,step_mask,dir_mask,duty. */
#include "trace_write.h"

#include <string.h>

static const char header[] = "t_ns,step_mask,dir_mask,duty\n";
enum { ROW = 20 + 1 + 3 + 1 + 3 + 1 + 5 + 1 };

static void put_row(struct trace_writer *writer, const struct trace_event *event) {
    char *p = trace_writer_room(writer, ROW);
    p = trace_put_u64(p, trace_ns(writer, event->t_ticks));
    *p++ = ',';
    p = trace_put_u64(p, event->step_mask);
    *p++ = ',';
    p = trace_put_u64(p, event->dir_mask);
    *p++ = ',';
    p = trace_put_u64(p, writer->duty);
    *p++ = '\n';
    trace_writer_keep(writer, p);
}

struct trace_writer *trace_csv_open(const char *path, uint32_t timer_hz, int *error) {
    struct trace_writer *writer = trace_rows_open(path, timer_hz, put_row, error);
    if (writer == NULL)
        return NULL;
    char *p = trace_writer_room(writer, sizeof header - 1);
    memcpy(p, header, sizeof header - 1);
    trace_writer_keep(writer, p + sizeof header - 1);
    return writer;
}
