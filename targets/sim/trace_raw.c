/* SPDX-License-Identifier: MIT
 * Step events -> little-endian records of 16 bytes: u64 t_ns, u8 step_mask, u8 dir_mask, u16 duty, 4 bytes 0.
 */
#include "trace_write.h"

#include <string.h>

enum { RECORD = 16 };

static void put_row(struct trace_writer *writer, const struct trace_event *event) {
    char *p = trace_writer_room(writer, RECORD);
    uint64_t t_ns = trace_ns(writer, event->t_ticks);
    for (unsigned byte = 0; byte < 8; byte++)
        p[byte] = (char)(uint8_t)(t_ns >> (8 * byte));
    p[8] = (char)event->step_mask;
    p[9] = (char)event->dir_mask;
    p[10] = (char)(uint8_t)writer->duty;
    p[11] = (char)(uint8_t)(writer->duty >> 8);
    memset(p + 12, 0, RECORD - 12);
    trace_writer_keep(writer, p + RECORD);
}

struct trace_writer *trace_raw_open(const char *path, uint32_t timer_hz, int *error) {
    return trace_rows_open(path, timer_hz, put_row, error);
}
