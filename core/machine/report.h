/* SPDX-License-Identifier: MIT
 * What the controller says of its own accord, and the status report. [task] */
#ifndef WIFICNC_MACHINE_REPORT_H
#define WIFICNC_MACHINE_REPORT_H

#include "machine/machine.h"

/** Bits of $10. */
enum { REPORT_MACHINE_POSITION = 1, REPORT_BUFFERS = 2, REPORT_LINES = 4 };

/** Of a pendant by 0x8B; none has ever been there: reports do not speak of it. */
enum mpg_control { MPG_NONE, MPG_WAITS, MPG_IN_CONTROL };

/** What reports wait for. */
struct machine_reports {
    uint8_t wco_wait;     /* reports until the field is due */
    uint8_t ov_wait;      /* reports until the field is due */
    uint8_t mpg;          /* enum mpg_control */
    bool mpg_due;         /* ... has changed */
    bool start_due;       /* board.start_id: in the first report after a banner */
    uint8_t coolant_told; /* COOLANT_ bits of which wiring_report_coolant() has spoken */
};

/** A job begins, or has ended: a coolant that the board lacks is reported again. */
static inline void report_forget_coolant(struct machine_reports *reports) {
    reports->coolant_told = 0;
}

/** A pendant has control, or not any more: the next report says so. */
static inline void report_changed_mpg(struct machine_reports *reports, bool on) {
    reports->mpg = on ? MPG_IN_CONTROL : MPG_WAITS;
    reports->mpg_due = true;
}

/** Grbl's greeting */
void report_banner(struct machine *machine);

/** board.start_id as 8 digits, with these texts before and after it; nothing where there is none */
void report_start(const struct machine *machine, const char *before, const char *behind);

/** [MSG:text] */
void report_message(struct machine *machine, const char *text);

/** Axes that homing could find and has not. Nothing when there is none. */
void report_not_homed(struct machine *machine);

/** `[MSG:` and how often motion slowed down because a task was late. */
void report_underruns(struct machine *machine);

/** How often the serial port has lost bytes, and how many came damaged; nothing where neither did. */
void report_gaps(struct machine *machine);

/** [MSG:comment of the line]; nothing when it has none. */
void report_line_comment(struct machine *machine);

/** [MSG:Tool change: Tn comment of the line] */
void report_tool_change(struct machine *machine);

/** ALARM:n */
void report_alarm(struct machine *machine, enum alarm alarm);

/** The next report has WCO. */
void report_changed_offset(struct machine *machine);

/** A report soon has Ov. */
void report_changed_override(struct machine *machine);

/** mm in the unit of $13, with its decimals. */
void report_length(const struct machine *machine, double mm);

/** Rate in the unit of $13. */
void report_rate(const struct machine *machine, double mm_s);

/** All axes of the board, with commas. */
void report_axes(const struct machine *machine, const double mm[AXIS_COUNT]);

/** Machine position of steps. */
void report_axes_steps(const struct machine *machine, const int32_t steps[AXIS_COUNT]);

#endif
