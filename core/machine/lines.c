/* SPDX-License-Identifier: MIT
 * The next line: startup lines, then what the sender has sent. */
#include "machine/lines.h"

#include "machine/answer.h"
#include "machine/command.h"
#include "machine/compute.h"
#include "machine/drive.h"
#include "machine/motor_current.h"
#include "machine/park.h"
#include "machine/parts.h"
#include "machine/reach.h"
#include "machine/report.h"
#include "machine/spindle_sync.h"
#include "machine/state.h"
#include "machine/stored_write.h"
#include "machine/task.h"
#include "machine/tool_change.h"
#include "machine/wiring.h"

#include <stddef.h>

enum status lines_begin_gcode(struct machine *machine) {
    const struct gcode_command *command = &machine->task.command;
    enum status status = reach_move(machine, &command->move);
    if (status == STATUS_OK)
        status = spindle_sync_check(machine, command);
    if (status == STATUS_OK)
        status = machine->park.open ? park_check(machine, command) : tool_change_check(machine, command);
    if (command->port >= 0 && command->port_kind == PORT_DIGITAL_OUT &&
        (torque_mask(machine) >> command->port & 1) != 0)
        status = STATUS_NO_PORT; /* it is a torque line */
    if (status != STATUS_OK)
        return status;
    wiring_report_coolant(machine);
    task_begin(machine);
    return STATUS_OK;
}

/* @param status  of the line so far */
static void begin_gcode(struct machine *machine, enum status status) {
    if (status == STATUS_OK)
        status = lines_begin_gcode(machine);
    if (status != STATUS_OK)
        answer_line(machine, status);
}

static void take_gcode(struct machine *machine, const char *line) {
    if (machine->life.state == MACHINE_ALARM || machine->life.state == MACHINE_JOG) {
        answer_line(machine, STATUS_LOCKED);
        return;
    }
    enum status status = gcode_line(&machine->interp.gcode, line, &machine->task.command);
    if (status != STATUS_OK)
        status = compute_line(machine, line, status);
    begin_gcode(machine, status);
}

/* Begin the next startup line after the banner or homing. @return false: none exists */
static bool take_startup(struct machine *machine) {
    while (machine->lines.startup < STARTUP_LINE_COUNT) {
        const char *line = machine->lines.startup_text[machine->lines.startup++];
        if (line[0] == '\0')
            continue;
        machine->lines.source = LINE_STARTUP;
        machine->lines.open = true;
        take_gcode(machine, line);
        return true;
    }
    if (!machine->lines.homed_line)
        return false;
    machine->lines.homed_line = false;
    machine->lines.source = LINE_STREAM;
    answer_line(machine, STATUS_OK);
    return true;
}

/* Began in the buffer before the jog was cancelled. */
static bool is_before_stop(struct machine_lines *lines) {
    lines->flushing = lines->flushing && (int32_t)(lines->flush_until - lines->from) > 0;
    return lines->flushing;
}

static bool is_flushed(struct machine *machine, const char *line) {
    return is_before_stop(&machine->lines) && line[0] == '$' && line[1] == 'J' && line[2] == '=';
}

/* It would have been locked out while the jog moved, or waited for its end: a stop does not begin it. */
static bool is_stopped(struct machine *machine, const char *line) {
    struct machine_lines *lines = &machine->lines;
    return is_before_stop(lines) && lines->refusing && lines->refuses_aside == machine->park.open &&
           (line[0] != '$' || line[1] == 'H');
}

static void open_line(struct machine *machine) {
    machine->lines.count++;
    machine->lines.source = LINE_STREAM;
    machine->lines.open = true;
}

/* A % begins a program, too. */
static void count_in_program(struct machine *machine, const char *line) {
    if (machine->park.open || line[0] == '$')
        return;
    if (line[0] == '%' && line[1] == '\0')
        machine->lines.program_line = 0;
    machine->lines.program_line++;
}

static void take_text(struct machine *machine, enum line_result result) {
    const char *line = machine->lines.reader.text;
    open_line(machine);
    count_in_program(machine, line);
    if (result == LINE_BROKEN) /* bytes were lost within it: to execute the rest would be another line */
        report_gaps(machine);
    if (result == LINE_READY && line_reader_has_message(&machine->lines.reader))
        report_line_comment(machine);
    if (result == LINE_OVERFLOW || result == LINE_BROKEN)
        answer_line(machine, STATUS_LINE_TOO_LONG);
    else if (line[0] == '\0' || is_flushed(machine, line))
        answer_line(machine, STATUS_OK);
    else if (is_stopped(machine, line))
        answer_line(machine, STATUS_LOCKED);
    else if (line[0] == '$')
        command_line(machine, line);
    else
        take_gcode(machine, line);
}

/* A line that found no room in the receive buffer: its place in the row of answers. One at a time, as there
 * is room for answers: a thousand of them would hold everything up. */
static bool answer_lost(struct machine *machine) {
    if (!rx_take_lost(&machine->lines.rx))
        return false;
    line_reader_reset(&machine->lines.reader);
    if (!machine->lines.overflow_told)
        report_message(machine, "Receive buffer overflow");
    machine->lines.overflow_told = true;
    take_text(machine, LINE_OVERFLOW);
    return true;
}

/* The fast way for streams: a plain line of G-code that has come whole is parsed where it lies, without the
 * copy and the filter of the line reader. What could be refused by the state goes the long way. @return bytes
 * taken; 0: it is none */
static size_t take_plain(struct machine *machine, const uint8_t *bytes, size_t count) {
    const uint8_t *line = line_reader_whole(&machine->lines.reader, bytes, count);
    if (line == NULL || machine->lines.flushing || machine->life.state == MACHINE_ALARM ||
        machine->life.state == MACHINE_JOG)
        return 0;
    const char *end = gcode_plain_line(&machine->interp.gcode, (const char *)line, &machine->task.command);
    if (end == NULL)
        return 0;
    line_reader_pass(&machine->lines.reader, (uint8_t)*end);
    open_line(machine);
    machine->lines.program_line++;
    begin_gcode(machine, STATUS_OK);
    return (size_t)((const uint8_t *)end - bytes) + 1;
}

/* Read up to the end of one line and begin it. @return false: no whole line is there */
static bool take(struct machine *machine) {
    for (;;) {
        const uint8_t *bytes;
        enum line_result result;
        size_t count = rx_peek(&machine->lines.rx, &bytes);
        if (count == 0)
            return answer_lost(machine);
        machine->lines.overflow_told = false;
        size_t plain = take_plain(machine, bytes, count);
        rx_drop(&machine->lines.rx,
                plain > 0 ? plain : line_reader_take(&machine->lines.reader, bytes, count, &result));
        if (plain == 0 && result == LINE_NONE)
            continue;
        if (plain == 0)
            take_text(machine, result);
        machine->lines.from = rx_taken(&machine->lines.rx);
        return true;
    }
}

/* $ lines are read while a jog moves; what G-code means depends on where that ends, and it may be stopped. */
static bool may_read_aside(struct machine *machine, uint8_t next) {
    const struct line_reader *reader = &machine->lines.reader;
    const bool begun = machine->lines.from != machine->lines.rx.aside_from && reader->length > 0;
    if (!begun)
        machine->lines.from = machine->lines.rx.aside_from;
    return (begun ? (uint8_t)reader->text[0] : next) == '$' || drive_rest_reached(machine);
}

/* As take(), of the operator's lines in a parked hold. */
static bool take_aside(struct machine *machine) {
    struct rx *rx = &machine->lines.rx;
    enum line_result result = LINE_NONE;
    const uint8_t *bytes;
    if (rx_peek_aside(rx, &bytes) == 0 || !may_read_aside(machine, bytes[0]))
        return false;
    for (size_t count; result == LINE_NONE && (count = rx_peek_aside(rx, &bytes)) > 0;)
        rx_drop_aside(rx, line_reader_take(&machine->lines.reader, bytes, count, &result));
    if (result == LINE_NONE)
        return false;
    if (machine->park.silent) {
        open_line(machine);
        answer_line(machine, STATUS_LOCKED);
    } else {
        take_text(machine, result);
    }
    machine->lines.from = rx->aside_from;
    return true;
}

static bool is_end(uint8_t byte) {
    return byte == '\n' || byte == '\r';
}

/* Ten times the number behind a G; -1: it is none. */
static int code_x10(const char *text) {
    int number = 0;
    if (*text < '0' || *text > '9')
        return -1;
    for (; *text >= '0' && *text <= '9' && number < 1000; text++)
        number = 10 * number + (*text - '0');
    const bool tenths = text[0] == '.' && text[1] >= '0' && text[1] <= '9';
    return 10 * number + (tenths ? text[1] - '0' : 0);
}

/* Lines that a program has behind its M6, too, are the operator's only after $J= or $T: those no program has.
 * Motion, M3 and all else waits with the job. */
static bool is_operators(struct machine *machine, const char *text) {
    if (text[0] == '$' && (text[1] == 'J' || text[1] == 'T'))
        park_know_operator(&machine->park);
    if (text[0] == '\0' || text[0] == '$')
        return text[0] == '\0' || machine->park.operators;
    if (text[0] != 'G' || !machine->park.operators)
        return false;
    switch (code_x10(text + 1)) {
    case 100: /* G10 */
    case 200: /* units, distance mode */
    case 210:
    case 382: /* G38.2 .. G38.5 */
    case 383:
    case 384:
    case 385:
    case 431: /* G43.1 */
    case 490:
    case 900:
    case 910:
    case 920: /* G92 .. */
    case 921:
    case 922:
    case 923:
        return true;
    default:
        return false;
    }
}

/* As take_aside(), of a tool change ($341): without 0xA3 the operator's lines come by the job's stream,
 * before any other of its lines. */
static bool take_unmarked(struct machine *machine) {
    struct rx *rx = &machine->lines.rx;
    enum { BEGIN = 40 };
    uint8_t begin[BEGIN];
    char text[BEGIN + 1];
    size_t left = rx_line(rx, begin, BEGIN), used = 0;
    enum line_result result = LINE_NONE;
    if (left == 0 || machine->park.silent || rx_aside(rx) != RX_ASIDE_NONE ||
        !line_reader_is_between(&machine->aside.job.lines.reader))
        return false;
    for (size_t at = 0; at < left && at < BEGIN && !is_end(begin[at]); at++)
        if (begin[at] > ' ')
            text[used++] = (char)(begin[at] >= 'a' && begin[at] <= 'z' ? begin[at] - 'a' + 'A' : begin[at]);
    text[used] = '\0';
    if (!is_operators(machine, text) || (text[0] != '$' && !drive_rest_reached(machine)))
        return false;
    while (left > 0 && result == LINE_NONE) {
        const uint8_t *bytes;
        size_t count = rx_peek(rx, &bytes);
        count = line_reader_take(&machine->lines.reader, bytes, count < left ? count : left, &result);
        rx_drop(rx, count);
        left -= count;
    }
    machine->lines.from = rx_taken(rx);
    if (result != LINE_NONE)
        take_text(machine, result);
    return true;
}

static bool take_next(struct machine *machine) {
    if (!machine->park.open)
        return take_startup(machine) || take(machine);
    return take_aside(machine) || (machine->park.tool && take_unmarked(machine));
}

bool lines_poll(struct machine *machine) {
    bool any = false;
    while (!machine->life.restart && !machine->clock.quiet.on && !stored_is_busy(machine)) {
        bool further = false;
        if (machine->task.stage != TASK_NONE)
            further = state_works(machine) && task_poll(machine);
        else if (state_reads(machine) && text_has_room(&machine->out))
            further = take_next(machine);
        if (!further)
            break;
        state_update(machine); /* the next line sees what this one began */
        any = true;
    }
    return any;
}

uint32_t machine_drop_unread(struct machine *machine) {
    struct machine_lines *lines = &machine->lines;
    const uint32_t dropped = rx_drop_job(&lines->rx);
    line_reader_reset(machine->park.open ? &machine->aside.job.lines.reader : &lines->reader);
    if (!machine->park.open)
        lines->from = rx_taken(&lines->rx);
    return dropped;
}
