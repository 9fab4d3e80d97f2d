/* SPDX-License-Identifier: MIT
 * Step events -> files: CSV to read, VCD for logic-analyser viewers, raw records for programs.
 *
 *   trace_X_open() -> trace_writer_attach() -> ... -> trace_writer_close()
 *
 * All times are nanoseconds from power-on, rounded down from ticks in integers: nothing drifts. A failed
 * write is kept (the first errno), nothing more is written, and trace_writer_close() reports it. */
#ifndef WIFICNC_SIM_TRACE_WRITE_H
#define WIFICNC_SIM_TRACE_WRITE_H

#include "base/axis.h"
#include "trace.h"

#include <stdbool.h>
#include <stdio.h>

enum { TRACE_BUFFER = 1 << 18, TRACE_SIGNALS = 2 * AXIS_COUNT };

/** What a VCD needs to know beyond the edges. */
struct trace_vcd {
    uint64_t now_ns;   /* time of the last change written */
    uint64_t fall_ns;  /* when the pulses of high_mask end */
    uint32_t pulse_ns; /* step high time */
    uint32_t dir_setup_ns;
    axis_mask_t high_mask;  /* step lines that are high */
    axis_mask_t dir_mask;   /* levels of the direction lines */
    axis_mask_t shown_step; /* step lines that have a name */
    axis_mask_t shown_dir;
};

struct trace_writer;

/** Write an event, with writer->duty. */
typedef void trace_row(struct trace_writer *writer, const struct trace_event *event);

/** One file being written. Fields are private to trace_write.c and the formats; consume is for trace_add().
 */
struct trace_writer {
    trace_consumer *consume;
    trace_row *row;
    trace_duty_consumer *follow;
    void (*finish)(struct trace_writer *writer); /* last words before closing, may be NULL */
    FILE *file;
    int error; /* first errno, 0 = none */
    uint32_t timer_hz;
    uint32_t ns_per_tick; /* 0: not a whole number */
    uint16_t duty;        /* of a laser */
    bool waits;           /* an event whose own duty may still come is not written yet: */
    struct trace_event waiting;
    struct trace_vcd vcd;
    size_t used;
    char buffer[TRACE_BUFFER];
};

/** `t_ns,step_mask,dir_mask,duty`, a line for every event; duty: of a laser from this edge on, 0 .. 65535.
 * @return NULL and *error = errno when it cannot be opened. */
struct trace_writer *trace_csv_open(const char *path, uint32_t timer_hz, int *error);

/** Little-endian records of 16 bytes: u64 t_ns, u8 step_mask, u8 dir_mask, u16 duty, 4 bytes 0. */
struct trace_writer *trace_raw_open(const char *path, uint32_t timer_hz, int *error);

/** Value change dump, 1 ns. A pulse falls step_pulse_ns after its edge. The edges do not say when a direction
 * line changed: it is drawn dir_setup_ns before the step that needs it, the latest the core may be.
 *  @param names  of the step lines X..C, then of the direction lines X..C; NULL: not drawn. Characters other
 * than letters, digits and _ become _. A laser's duty is a vector of 16 bits, `duty`, drawn when it changes.
 */
struct trace_writer *trace_vcd_open(const char *path, uint32_t timer_hz, uint32_t step_pulse_ns,
                                    uint32_t dir_setup_ns, const char *const names[TRACE_SIGNALS],
                                    int *error);

/** From now on it gets what happens. @return false: the trace has no place left */
bool trace_writer_attach(struct trace_writer *writer, struct trace *trace);

/** Write what is left, close, free. @return 0, or the first errno. NULL is 0. */
int trace_writer_close(struct trace_writer *writer);

/* For the formats. */

/** One that writes a row for each event. */
struct trace_writer *trace_rows_open(const char *path, uint32_t timer_hz, trace_row *row, int *error);

struct trace_writer *trace_writer_open(const char *path, uint32_t timer_hz, trace_consumer *consume,
                                       int *error);

/** Room for size more bytes (size <= TRACE_BUFFER). @return where to put them; then trace_writer_keep(end).
 */
char *trace_writer_room(struct trace_writer *writer, size_t size);

static inline void trace_writer_keep(struct trace_writer *writer, const char *end) {
    writer->used = (size_t)(end - writer->buffer);
}

/** Ticks -> ns, exact, rounded down; good for centuries. */
static inline uint64_t trace_ns(const struct trace_writer *writer, uint64_t ticks) {
    if (writer->ns_per_tick != 0)
        return ticks * writer->ns_per_tick;
    uint64_t seconds = ticks / writer->timer_hz;
    return seconds * 1000000000u + ticks % writer->timer_hz * 1000000000u / writer->timer_hz;
}

/** Decimal digits of value at p (up to 20). @return past the last one. */
char *trace_put_u64(char *p, uint64_t value);

#endif
