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
#include "machine/wiring.h"

#include <stddef.h>

enum status lines_begin_gcode(struct machine *machine) {
    const struct gcode_command *command = &machine->task.command;
    enum status status = reach_move(machine, &command->move);
    if (status == STATUS_OK)
        status = spindle_sync_check(machine, command);
    if (status == STATUS_OK && machine->park.open)
        status = park_check(machine, command);
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
static bool is_flushed(struct machine *machine, const char *line) {
    if (!machine->lines.flushing)
        return false;
    machine->lines.flushing = (int32_t)(machine->lines.flush_until - machine->lines.from) > 0;
    return machine->lines.flushing && line[0] == '$' && line[1] == 'J' && line[2] == '=';
}

static void open_line(struct machine *machine) {
    machine->lines.count++;
    machine->lines.source = LINE_STREAM;
    machine->lines.open = true;
}

static void take_text(struct machine *machine, enum line_result result) {
    const char *line = machine->lines.reader.text;
    open_line(machine);
    if (result == LINE_BROKEN) /* bytes were lost within it: to execute the rest would be another line */
        report_gaps(machine);
    if (result == LINE_OVERFLOW || result == LINE_BROKEN)
        answer_line(machine, STATUS_LINE_TOO_LONG);
    else if (line[0] == '\0' || is_flushed(machine, line))
        answer_line(machine, STATUS_OK);
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

static bool take_next(struct machine *machine) {
    return machine->park.open ? take_aside(machine) : take_startup(machine) || take(machine);
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
