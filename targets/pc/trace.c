/* SPDX-License-Identifier: MIT
 * Chunks of step events -> consumers. */
#include "trace.h"

int trace_add(struct trace *trace, trace_consumer *consume, void *ctx) {
    if (trace->consumers == TRACE_CONSUMERS)
        return 0;
    trace_flush(trace); /* what happened before is not the newcomer's */
    trace->consume[trace->consumers] = consume;
    trace->ctx[trace->consumers] = ctx;
    trace->follow[trace->consumers] = NULL;
    trace->consumers++;
    return 1;
}

void trace_add_duty(struct trace *trace, trace_duty_consumer *follow) {
    trace->follow[trace->consumers - 1] = follow;
}

void trace_set_duty(struct trace *trace, uint64_t t_ticks, uint16_t duty) {
    trace_flush(trace);
    for (size_t i = 0; i < trace->consumers; i++)
        if (trace->follow[i] != NULL)
            trace->follow[i](trace->ctx[i], t_ticks, duty);
}

void trace_flush(struct trace *trace) {
    if (trace->count == 0)
        return;
    for (size_t i = 0; i < trace->consumers; i++)
        trace->consume[i](trace->ctx[i], trace->events, trace->count);
    trace->total += trace->count;
    trace->count = 0;
}
