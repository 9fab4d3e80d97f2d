/* SPDX-License-Identifier: MIT
 * One G-code job through a host controller: streams the text, pairs answers with lines, measures the step edges.
 *
 * Usage: sim_create, settings by sim_command("$110=5000"), trace outputs, then sim_run until it says it is done,
 * then the results. All strings are copied. Called from one thread; Python drives it through ctypes. */
#ifndef WIFICNC_HOST_SIM_H
#define WIFICNC_HOST_SIM_H

#include "host.h"

struct sim;

/** @return NULL when memory is short or the board is out of range. */
struct sim *sim_create(const struct host_board *board);
void sim_destroy(struct sim *sim);

/** Send one line (no line end) and run until it is answered. @return 0 for ok, the error number, or -1 for no answer. */
int sim_command(struct sim *sim, const char *line);

/** Load the job. @param keep_going 0: stop feeding after the first error. */
int sim_load(struct sim *sim, const char *text, size_t size, int keep_going);

/** Work for at most max_events step events. @return 1 while there is more, 0 when done. */
int sim_run(struct sim *sim, uint64_t max_events);

/** Lines sent so far (for a progress bar) and lines in all. */
void sim_progress(const struct sim *sim, uint64_t *lines_done, uint64_t *lines_total);

/** Errors found: index 0 .. sim_error_count()-1; line is 1-based in the file. */
struct sim_error {
    uint32_t line;
    int32_t code;
};
size_t sim_error_count(const struct sim *sim);
struct sim_error sim_error_at(const struct sim *sim, size_t index);

/** Figures measured from the step edges. Speeds and accelerations: box windows of 10 ms (see measure.c). */
struct sim_result {
    struct host_counters counters;
    uint64_t job_ticks;                      /* from the first to the last step edge or dwell end */
    uint64_t cutting_ticks, rapid_ticks;
    int64_t steps_total[AXIS_COUNT];         /* pulses, both directions */
    int32_t position_steps[AXIS_COUNT];
    int32_t min_steps[AXIS_COUNT], max_steps[AXIS_COUNT];
    double max_speed_mm_s[AXIS_COUNT];
    double max_accel_mm_s2[AXIS_COUNT];
    double max_step_rate_hz;                 /* of the fastest axis, from the shortest interval between its edges */
    double steps_per_mm[AXIS_COUNT];
};
void sim_result(const struct sim *sim, struct sim_result *out);

/** Trace writers; call before sim_run. @return 0, or errno. */
int sim_trace_csv(struct sim *sim, const char *path);  /* t_ns,step_mask,dir_mask */
int sim_trace_vcd(struct sim *sim, const char *path, const char *const names[2 * AXIS_COUNT]); /* step X..C, dir X..C */
int sim_trace_raw(struct sim *sim, const char *path);  /* little-endian records u64 t_ns, u8 step, u8 dir, padded to 16 */

/** Path samples for pictures: one every interval_ms of motion (first and last always). */
struct sim_sample {
    float t_s;
    float position_mm[AXIS_COUNT];
    float speed_mm_s; /* along the path, from the step edges */
    uint8_t rapid;
};
int sim_sample_every(struct sim *sim, double interval_ms);
size_t sim_samples(const struct sim *sim, const struct sim_sample **out);

/** Finish the trace files. Called once, after the last sim_run. @return 0, or errno of the first failed write. */
int sim_close(struct sim *sim);

#endif
