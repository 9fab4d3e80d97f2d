/* SPDX-License-Identifier: MIT
 * Step events of the host target: recorded by the HAL in chunks, consumed by measurements and writers.
 *
 * The step ISR appends one trace_event per step edge (targets/pc/hal/hal_step.h); when the chunk is full,
 * and at trace_flush(), every consumer gets the chunk. Consumers see all events, in order, exactly once. */
#ifndef WIFICNC_PC_TRACE_H
#define WIFICNC_PC_TRACE_H

#include <stddef.h>
#include <stdint.h>

/** One rising edge of the step lines. hal_step.h writes it as two 64-bit words: this layout, little-endian.
 */
struct trace_event {
    uint64_t t_ticks;  /* of the board's step timer, from power-on */
    uint8_t step_mask; /* bit n = axis n, never 0 */
    uint8_t dir_mask;  /* bit n = axis n moves in negative direction; level of the lines at this edge */
    uint8_t flags;     /* SEGMENT_ flags of the motion this step belongs to (rapid, probe, ...) */
    uint8_t dwells; /* counts up with every span of a dwell (mod 256): time since the event before was not all
                       motion */
    uint32_t line;  /* source line: 1-based count of lines the controller has taken, 0 = unknown */
};
_Static_assert(sizeof(struct trace_event) == 16, "two words");

/** Gets every event. ctx is the consumer's own. */
typedef void trace_consumer(void *ctx, const struct trace_event *events, size_t count);

/** Gets every change of a laser's duty, 0 .. 65535, between the events before and after it. */
typedef void trace_duty_consumer(void *ctx, uint64_t t_ticks, uint16_t duty);

enum { TRACE_CHUNK = 4096, TRACE_CONSUMERS = 8 };

struct trace {
    size_t count;
    uint64_t total; /* events handed on so far */
    size_t consumers;
    trace_consumer *consume[TRACE_CONSUMERS];
    trace_duty_consumer *follow[TRACE_CONSUMERS]; /* NULL: has no use for it */
    void *ctx[TRACE_CONSUMERS];
    struct trace_event events[TRACE_CHUNK];
};

/** Add a consumer. With none, events are dropped as soon as a chunk is full. @return false: no place left. */
int trace_add(struct trace *trace, trace_consumer *consume, void *ctx);

/** The newest consumer gets changes of the duty, too. */
void trace_add_duty(struct trace *trace, trace_duty_consumer *follow);

/** A laser's duty has changed. All events before have been recorded. */
void trace_set_duty(struct trace *trace, uint64_t t_ticks, uint16_t duty);

/** Hand all recorded events to the consumers. */
void trace_flush(struct trace *trace);

#endif
