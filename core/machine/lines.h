/* SPDX-License-Identifier: MIT
 * The next line: startup lines, then what the sender has sent. [task] */
#ifndef WIFICNC_MACHINE_LINES_H
#define WIFICNC_MACHINE_LINES_H

#include "input/line_reader.h"
#include "input/rx.h"
#include "machine/machine.h"
#include "settings/settings.h"

#include <string.h>

/** Whose line the current one is. */
enum line_source { LINE_STREAM, LINE_STARTUP, LINE_STORED };

/** Lines on their way from bytes to answers. */
struct machine_lines {
    struct rx rx;
    struct line_reader reader;
    bool open;            /* the current line is not answered yet */
    bool overflow_told;   /* that the lines that were just lost are */
    uint32_t flush_until; /* $J= lines put before this many bytes are dropped, while flushing */
    bool flushing;
    bool refusing,
        refuses_aside; /* ... and others that begin something are refused; they are the operator's */
    uint32_t from;     /* bytes taken before the present line */
    enum line_source source;
    uint8_t startup;       /* next startup line to run; STARTUP_LINE_COUNT = none */
    uint8_t store_as;      /* LINE_STORED: which one */
    bool homed_line;       /* $H is answered after the startup lines */
    uint32_t count;        /* lines taken */
    uint32_t program_line; /* of these, without $ lines, since the program began */
    char startup_text[STARTUP_LINE_COUNT][GRBL_LINE_SIZE];
    char info[GRBL_LINE_SIZE]; /* $I= */
};

/** The startup lines come next, or none of them. */
static inline void lines_run_startup(struct machine_lines *lines, bool runs) {
    lines->startup = runs ? 0 : STARTUP_LINE_COUNT;
}

/** Jogs that wait to be read are no longer wanted. */
static inline void lines_flush_jogs(struct machine_lines *lines) {
    lines->flush_until = rx_cancel_at(&lines->rx);
    lines->flushing = true;
    lines->refusing = false;
}

/** After lines_flush_jogs(): what else waits behind a motion that is stopped does not begin.
 *  @param aside  the motion is the operator's, of a parked hold: so are these lines */
static inline void lines_refuse_waiting(struct machine_lines *lines, bool aside) {
    lines->refusing = true;
    lines->refuses_aside = aside;
}

/** $H is done: it is answered after the startup lines; or no one waits for that. */
static inline void lines_answer_homing(struct machine_lines *lines, bool answers) {
    lines->homed_line = answers;
}

/** The present line is $Nx=: it is kept when it went well. */
static inline void lines_store_as(struct machine_lines *lines, unsigned index) {
    lines->source = LINE_STORED;
    lines->store_as = (uint8_t)index;
}

/** M2, M30: the next line is the first one of a program. */
static inline void lines_end_program(struct machine_lines *lines) {
    lines->program_line = 0;
}

/** Reset: what was begun is over. */
static inline void lines_forget(struct machine_lines *lines) {
    lines->flushing = lines->homed_line = false;
    lines->program_line = 0;
    lines->startup = STARTUP_LINE_COUNT;
}

/** The line under way, as far as it is read. */
struct lines_aside {
    struct line_reader reader;
    bool open;
    enum line_source source;
};

/** The operator's lines begin. */
static inline void lines_begin_aside(struct machine_lines *lines) {
    line_reader_reset(&lines->reader);
    lines->from = lines->rx.aside_from;
}

/** The present line waits in `aside`, and the operator's come. */
static inline void lines_put_aside(struct machine_lines *lines, struct lines_aside *aside) {
    memcpy(&aside->reader, &lines->reader, sizeof aside->reader);
    aside->open = lines->open;
    aside->source = lines->source;
    lines->open = false;
    lines_begin_aside(lines);
}

/** No line is half read: the operator's come from where it ends, without 0xA3. */
static inline void lines_read_on(struct machine_lines *lines, const struct lines_aside *aside) {
    memcpy(&lines->reader, &aside->reader, sizeof lines->reader);
}

/** It continues. */
static inline void lines_take_back(struct machine_lines *lines, const struct lines_aside *aside) {
    memcpy(&lines->reader, &aside->reader, sizeof lines->reader);
    lines->open = aside->open;
    lines->source = aside->source;
    lines->from = rx_taken(&lines->rx);
}

/** Nothing that came so far is read any more. @return whether a line of a sender waits for its answer; it
 * does not any more */
static inline bool lines_drop(struct machine_lines *lines) {
    const bool waits = lines->open && lines->source != LINE_STARTUP;
    rx_flush(&lines->rx);
    lines->from = rx_taken(&lines->rx);
    line_reader_reset(&lines->reader);
    lines->open = false;
    return waits;
}

/** Begin the line that was resolved into machine->task.command.
 * @return why this machine cannot do it, and nothing has happened; or STATUS_OK: its task answers */
enum status lines_begin_gcode(struct machine *machine);

/** Carry on with the line that is under way, or begin the next ones, until something must be waited for.
 * @return true when anything was done */
bool lines_poll(struct machine *machine);

#endif
