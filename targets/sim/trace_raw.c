/* SPDX-License-Identifier: MIT
 * Step events -> little-endian records of 16 bytes: u64 t_ns, u8 step_mask, u8 dir_mask, u16 duty, 4 bytes 0.
 */
#include "trace_write.h"

#include <string.h>

enum { RECORD = 16 };

static void consume(void *ctx, const struct trace_event *events, size_t count) {
    struct trace_writer *writer = ctx;
    if (writer->error != 0)
        return;
    for (size_t i = 0; i < count; i++) {
        char *p = trace_writer_room(writer, RECORD);
        uint64_t t_ns = trace_ns(writer, events[i].t_ticks);
        for (unsigned byte = 0; byte < 8; byte++)
            p[byte] = (char)(uint8_t)(t_ns >> (8 * byte));
        p[8] = (char)events[i].step_mask;
        p[9] = (char)events[i].dir_mask;
        p[10] = (char)(uint8_t)writer->duty;
        p[11] = (char)(uint8_t)(writer->duty >> 8);
        memset(p + 12, 0, RECORD - 12);
        trace_writer_keep(writer, p + RECORD);
    }
}

struct trace_writer *trace_raw_open(const char *path, uint32_t timer_hz, int *error) {
    return trace_writer_open(path, timer_hz, consume, error);
}
