/* SPDX-License-Identifier: MIT
 * What the controller prints without a request, and the parts that the status report is made of. */
#include "machine/report.h"

#include "machine/axes.h"
#include "machine/parts.h"
#include "machine/place.h"

#define MM_PER_INCH 25.4

void report_message(struct machine *machine, const char *text) {
    text_string(&machine->out, "[MSG:");
    text_string(&machine->out, text);
    text_string(&machine->out, "]\r\n");
}

void report_not_homed(struct machine *machine) {
    axis_mask_t axes = machine->settings.homing ? axes_not_homed(machine) : 0;
    char letters[AXIS_COUNT + 1], *at = letters;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if ((axes >> ax & 1) != 0)
            *at++ = AXIS_LETTERS[ax];
    *at = '\0';
    if (axes == 0)
        return;
    text_string(&machine->out, "[MSG:Not homed: ");
    text_string(&machine->out, letters);
    text_string(&machine->out, "]\r\n");
}

void report_underruns(struct machine *machine) {
    const uint32_t times = machine->drive.late_seen - machine->drive.late_dial;
    if (times == 0)
        return;
    text_string(&machine->out, "[MSG:Motion slowed down because the controller was busy: ");
    text_int(&machine->out, (int32_t)times);
    text_string(&machine->out, times == 1 ? " time]\r\n" : " times]\r\n");
}

void report_gaps(struct machine *machine) {
    const uint32_t overruns = rx_gaps(&machine->lines.rx, RX_OVERRUN);
    const uint32_t unframed = rx_gaps(&machine->lines.rx, RX_UNFRAMED);
    if (overruns > 0) {
        text_string(&machine->out, "[MSG:Bytes lost on the serial port: ");
        text_int(&machine->out, (int32_t)overruns);
        text_string(&machine->out, overruns == 1 ? " time]\r\n" : " times]\r\n");
    }
    if (unframed > 0) {
        text_string(&machine->out, "[MSG:Framing errors on the serial port: ");
        text_int(&machine->out, (int32_t)unframed);
        text_string(&machine->out, ". Check the baud rate and the cable]\r\n");
    }
}

static void report_comment(const struct machine *machine) {
    char text[LINE_COMMENT_SIZE + 1];
    if (!line_reader_comment(&machine->lines.reader, text, sizeof text) || text[0] == '\0')
        return;
    text_string(&machine->out, " ");
    text_string(&machine->out, text);
}

void report_tool_change(struct machine *machine) {
    text_string(&machine->out, "[MSG:Tool change: T");
    text_int(&machine->out, machine->task.command.next.tool);
    report_comment(machine);
    text_string(&machine->out, "]\r\n");
}

void report_alarm(struct machine *machine, enum alarm alarm) {
    text_string(&machine->out, "ALARM:");
    text_int(&machine->out, (int32_t)alarm);
    text_string(&machine->out, "\r\n");
}

void report_banner(struct machine *machine) {
    text_string(&machine->out, MACHINE_BANNER);
    machine->reports.start_due = true;
}

void report_start(const struct machine *machine, const char *before, const char *behind) {
    if (machine->board.start_id == 0)
        return;
    text_string(&machine->out, before);
    text_hex(&machine->out, machine->board.start_id);
    text_string(&machine->out, behind);
}

void report_changed_offset(struct machine *machine) {
    machine->reports.wco_wait = 0;
}

void report_changed_override(struct machine *machine) {
    machine->reports.ov_wait = 0;
}

void report_length(const struct machine *machine, double mm) {
    bool inches = machine->settings.report_inches;
    text_fixed(&machine->out, inches ? mm / MM_PER_INCH : mm, inches ? 4 : 3);
}

void report_rate(const struct machine *machine, double mm_s) {
    bool inches = machine->settings.report_inches;
    text_fixed(&machine->out, 60.0 * mm_s / (inches ? MM_PER_INCH : 1.0), inches ? 1 : 0);
}

void report_axes(const struct machine *machine, const double mm[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++) {
        text_string(&machine->out, ax == 0 ? "" : ",");
        if (ax < AXIS_A)
            report_length(machine, mm[ax]);
        else
            text_fixed(&machine->out, mm[ax], 3); /* degrees have no inches */
    }
}

void report_axes_steps(const struct machine *machine, const int32_t steps[AXIS_COUNT]) {
    double mm[AXIS_COUNT];
    place_tool_mm(machine, steps, mm);
    report_axes(machine, mm);
}
