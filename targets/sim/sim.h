/* SPDX-License-Identifier: MIT
 * One G-code job through a host controller: streams the text, pairs answers with lines, measures the step
 * edges.
 *
 * Usage: sim_create, settings by sim_command("$110=5000"), trace outputs, sim_load, then sim_run until it
 * says it is done, sim_close, then the results. All strings are copied. Called from one thread; Python drives
 * it through ctypes. */
#ifndef WIFICNC_SIM_SIM_H
#define WIFICNC_SIM_SIM_H

#include "host.h"
#include "measure.h"
#include "program_end.h"
#include "sim_script.h"
#include "survey.h"

struct sim;

/** @return NULL when memory is short or the board is out of range. */
struct sim *sim_create(const struct host_board *board);
void sim_destroy(struct sim *sim);

/** Send one line (no line end) and run until it is answered. @return 0 for ok, the error number, or -1 for no
 * answer. */
int sim_command(struct sim *sim, const char *line);

/** Note what each line asks for and gets. Call before sim_load(). */
void sim_survey(struct sim *sim);

/** What was noted of the job; NULL before sim_load(). */
const struct survey *sim_surveyed(const struct sim *sim);

/** How many lines a program with O words may execute before it counts as endless; SIM_LINES_MAX unless told.
 */
enum { SIM_LINES_MAX = 1000000 };
void sim_limit_lines(struct sim *sim, uint32_t lines_max);

/** Load the job; time counts from here. See sim_text.h for how a file becomes lines. A program with O words
 * is expanded first (expand.h), from position 0 as after power-on; an error there is an error of its line.
 *  Each line waits for the answer to the one before. Time stops while the controller works, so that
 * this costs no look-ahead, and nothing behind a bad line is on its way already when the job must stop.
 *  @param keep_going  0: nothing is sent after the first error; 1: errors are collected.
 *  @return 0, or ENOMEM. */
int sim_load(struct sim *sim, const char *text, size_t size, int keep_going);

/** While the job runs, this happens at the machine: a line of hands.h, t_s seconds of virtual time after
 * sim_load(). Call after the settings and before sim_load(). After an alarm or a reset the job is over, but
 * the events that are left still happen.
 * @return NULL, or what is wrong with the line */
const char *sim_at(struct sim *sim, double t_s, const char *line);

/** The events, in the order of their times, and what each of them found: index 0 .. sim_event_count()-1. */
size_t sim_event_count(const struct sim *sim);
struct script_event sim_event_at(const struct sim *sim, size_t index);

/** Work for about max_events step events. A pause of the program (M0) and a tool change (M6) end immediately,
 * as by an operator. A controller that rests although it owes an answer ends the job with SIM_NO_ANSWER.
 *  @return 1 while there is more, 0 when done. */
int sim_run(struct sim *sim, uint64_t max_events);

/** Lines answered so far, and lines of the file (for a progress bar); of a program with O words, the lines
 * that it executes. */
void sim_progress(const struct sim *sim, uint64_t *lines_done, uint64_t *lines_total);

/** The line of the file (1-based) whose motion is being made; 0 before the first one. After the end, the last
 * line. */
uint32_t sim_line_now(const struct sim *sim);

/** What went wrong with a line. */
enum sim_error_kind {
    SIM_ERROR,     /* error:code */
    SIM_ALARM,     /* ALARM:code; the job ends there */
    SIM_NO_ANSWER, /* the controller rests and owes this line its answer, code 0; the job ends there */
    SIM_SURPLUS,   /* an answer without a line, after this line; code 0 */
    SIM_HELD,      /* an event held it and none resumes it, code 0; the job ends there */
    SIM_RESET,     /* an event reset it, code 0; the job ends there */
};

/** Errors found: index 0 .. sim_error_count()-1; line is 1-based in the file, 0 = before the first one. */
struct sim_error {
    uint32_t line;
    int32_t code;
    uint32_t kind;
};
size_t sim_error_count(const struct sim *sim);
struct sim_error sim_error_at(const struct sim *sim, size_t index);

/** Tool changes (M6) so far, in the order of their times; a line that runs several times comes several times.
 */
struct sim_tool_change {
    double t_s;    /* since sim_load() */
    uint32_t line; /* 1-based in the file */
    int32_t tool;  /* T */
};
size_t sim_tool_changes(const struct sim *sim, const struct sim_tool_change **out);

/** What the controller said by the way: its [MSG:...] lines, in order, since sim_create(). At most 1000 are
 * kept. */
size_t sim_message_count(const struct sim *sim);
const char *sim_message_at(const struct sim *sim, size_t index);

/** Figures measured from the step edges. Speeds: box windows of 10 ms; accelerations: measure.h. */
struct sim_result {
    struct host_counters counters;
    uint64_t job_ticks;                  /* from sim_load() to the last step edge or dwell end, or to now */
    uint64_t cutting_ticks, rapid_ticks; /* of these; the rest is dwell */
    uint64_t lines;                      /* of the file */
    uint64_t percent_lines;              /* not sent: they begin with % */
    struct program_end program_end;      /* what of the file was not run */
    uint64_t pauses;                     /* program pauses ended by us */
    int64_t steps_total[AXIS_COUNT];     /* pulses, both directions */
    int32_t position_steps[AXIS_COUNT];  /* the controller's counters */
    int32_t measured_steps[AXIS_COUNT];  /* the same from the edges, and host_shift_steps() */
    int32_t min_steps[AXIS_COUNT], max_steps[AXIS_COUNT];
    double max_speed_mm_s[AXIS_COUNT];
    double max_accel_mm_s2[AXIS_COUNT];
    double accel_window_s[AXIS_COUNT]; /* over which that was measured */
    double max_step_rate_hz;           /* of the fastest axis, from the shortest interval between its edges */
    double steps_per_mm[AXIS_COUNT];
    double position_mm[AXIS_COUNT];                /* of the tool */
    double min_mm[AXIS_COUNT], max_mm[AXIS_COUNT]; /* of the tool, the start included */
};
void sim_result(const struct sim *sim, struct sim_result *out);

/** Trace writers; call before sim_run. @return 0, or errno. Formats: trace_write.h. */
int sim_trace_csv(struct sim *sim, const char *path);
int sim_trace_vcd(struct sim *sim, const char *path,
                  const char *const names[2 * AXIS_COUNT]); /* step X..C, dir X..C */
int sim_trace_raw(struct sim *sim, const char *path);

/** Path samples for pictures: one every interval_ms of motion (first and last always). @return 0 */
int sim_sample_every(struct sim *sim, double interval_ms);
size_t sim_samples(const struct sim *sim, const struct path_sample **out);

/** Finish the trace files. Called once, after the last sim_run. @return 0; errno of the first failed write;
 * ENOMEM: samples or pieces are missing */
int sim_close(struct sim *sim);

#endif
