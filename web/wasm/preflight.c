/* SPDX-License-Identifier: MIT
 * The core in the browser: a job through the real controller in virtual time (targets/sim/sim.h), and the
 * modes that lines before some line have set (rebuild.h), for a resume. web/src/job/core.ts calls it.
 *
 * One job and one rebuild at a time. Reports are JSON text in one static buffer: good until the next report.
 */
#include "rebuild.h"
#include "sim.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#define EXPORT(name) __attribute__((export_name(#name)))

enum { REPORT_SIZE = 1 << 16, ERRORS_SHOWN = 50, MESSAGES_SHOWN = 50, TOOL_CHANGES_SHOWN = 100 };

static struct sim *sim;
static struct host_board board;
static struct rebuild *rebuild;
static double axes_mm[AXIS_COUNT];
static char report[REPORT_SIZE];
static size_t report_size;

/* ---- memory that JavaScript writes to ---- */

EXPORT(core_alloc) char *core_alloc(size_t size) {
    return malloc(size);
}

EXPORT(core_free) void core_free(char *memory) {
    free(memory);
}

/** Six doubles, for the calls that take a place. */
EXPORT(core_axes) double *core_axes(void) {
    return axes_mm;
}

/* ---- JSON ---- */

static void add(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    int size = vsnprintf(report + report_size, REPORT_SIZE - report_size, format, arguments);
    va_end(arguments);
    if (size > 0)
        report_size += (size_t)size;
    if (report_size >= REPORT_SIZE)
        report_size = REPORT_SIZE - 1;
}

/* The controller's own words: printable, and without what JSON would have to escape. */
static void add_text(const char *text) {
    add("\"");
    for (; *text != '\0'; text++)
        if (*text >= ' ' && *text <= '~' && *text != '"' && *text != '\\')
            add("%c", *text);
    add("\"");
}

static void add_numbers(const char *name, const double *numbers) {
    add("\"%s\":[", name);
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++)
        add(isfinite(numbers[axis]) ? "%s%.6f" : "%snull", axis > 0 ? "," : "", numbers[axis]);
    add("],");
}

static void add_number(const char *name, double number) {
    add(isfinite(number) ? "\"%s\":%.9g," : "\"%s\":null,", name, number);
}

/* ---- the job ---- */

/** A controller on a board like this (struct host_board). @return 0, or -1: no such board, or no memory */
EXPORT(core_open)
int core_open(uint32_t timer_hz, uint32_t step_pulse_ns, uint32_t default_pulse_us, uint32_t dir_setup_ns,
              uint32_t max_step_rate_hz, uint32_t axes, uint32_t ganged, uint32_t missing_outputs,
              uint32_t digital_inputs, uint32_t digital_outputs, uint32_t encoder, uint32_t analog,
              uint32_t home_axes, uint32_t toolsetter, uint32_t spindle_bus) {
    board = (struct host_board){.timer_hz = timer_hz,
                                .step_pulse_ns = step_pulse_ns,
                                .default_pulse_us = (uint8_t)default_pulse_us,
                                .dir_setup_ns = dir_setup_ns,
                                .max_step_rate_hz = max_step_rate_hz,
                                .axis_count = (uint8_t)axes,
                                .ganged = (axis_mask_t)ganged,
                                .missing_outputs = (uint8_t)missing_outputs,
                                .digital_inputs = (uint8_t)digital_inputs,
                                .digital_outputs = (uint8_t)digital_outputs,
                                .encoder = (uint8_t)encoder,
                                .analog = (uint8_t)analog,
                                .home_axes = (axis_mask_t)home_axes,
                                .toolsetter = (uint8_t)toolsetter,
                                .spindle_bus = (uint8_t)spindle_bus};
    sim_destroy(sim);
    sim = sim_create(&board);
    return sim != NULL ? 0 : -1;
}

/** A line before the job, like $110=5000. @return 0, N of error:N, or -1 */
EXPORT(core_command) int core_command(const char *line) {
    return sim_command(sim, line);
}

/** The job; a sample of the path every so many ms. @return 0, or an errno */
EXPORT(core_load) int core_load(const char *text, size_t size, double sample_ms) {
    if (sim_sample_every(sim, sample_ms) != 0)
        return -1;
    return sim_load(sim, text, size, 1);
}

/** @return 1 while there is more */
EXPORT(core_run) int core_run(uint32_t max_events) {
    return sim_run(sim, max_events);
}

EXPORT(core_lines_done) double core_lines_done(void) {
    uint64_t done, total;
    sim_progress(sim, &done, &total);
    return (double)done;
}

/** The line in the file that is being moved. */
EXPORT(core_line_now) uint32_t core_line_now(void) {
    return sim_line_now(sim);
}

EXPORT(core_seconds) double core_seconds(void) {
    struct sim_result result;
    sim_result(sim, &result);
    return (double)result.job_ticks / board.timer_hz;
}

EXPORT(core_sample_count) size_t core_sample_count(void) {
    const struct path_sample *samples;
    return sim_samples(sim, &samples);
}

/** struct path_sample (measure.h): t_s, six positions, speed, rapid; 36 bytes each. */
EXPORT(core_samples) const struct path_sample *core_samples(void) {
    const struct path_sample *samples;
    (void)sim_samples(sim, &samples);
    return samples;
}

static const struct engraving *engraving(void) {
    return survey_engraving(sim_surveyed(sim));
}

EXPORT(core_piece_count) size_t core_piece_count(void) {
    const struct engraving_piece *pieces;
    return engraving_pieces(engraving(), &pieces);
}

/** struct engraving_piece: t_s, X Y Z from and to, length, energy; 36 bytes each. */
EXPORT(core_pieces) const struct engraving_piece *core_pieces(void) {
    const struct engraving_piece *pieces;
    (void)engraving_pieces(engraving(), &pieces);
    return pieces;
}

static void add_engraving(void) {
    struct engraving_result burnt;
    engraving_result(engraving(), &burnt);
    add(",\"engraving\":{");
    add_number("constant_mm", burnt.constant_mm);
    add_number("slow_mm", burnt.slow_mm);
    add_number("limit", burnt.limit);
    add_number("worst", burnt.worst);
    add("\"worst_line\":%u,\"worst_mm\":[%.6f,%.6f,%.6f]}", (unsigned)burnt.worst_line, burnt.worst_mm[0],
        burnt.worst_mm[1], burnt.worst_mm[2]);
}

static void add_errors(void) {
    size_t count = sim_error_count(sim);
    add("\"errors\":[");
    for (size_t i = 0; i < count && i < ERRORS_SHOWN; i++) {
        struct sim_error error = sim_error_at(sim, i);
        add("%s{\"line\":%u,\"code\":%d,\"kind\":%u}", i > 0 ? "," : "", (unsigned)error.line,
            (int)error.code, (unsigned)error.kind);
    }
    add("],\"error_count\":%u,\"messages\":[", (unsigned)count);
    for (size_t i = 0; i < sim_message_count(sim) && i < MESSAGES_SHOWN; i++) {
        add("%s", i > 0 ? "," : "");
        add_text(sim_message_at(sim, i));
    }
    add("]");
}

static void add_tool_changes(void) {
    const struct sim_tool_change *changes;
    size_t count = sim_tool_changes(sim, &changes);
    add(",\"tool_change_count\":%u,\"tool_changes\":[", (unsigned)count);
    for (size_t i = 0; i < count && i < TOOL_CHANGES_SHOWN; i++)
        add("%s{\"line\":%u,\"tool\":%d}", i > 0 ? "," : "", (unsigned)changes[i].line, (int)changes[i].tool);
    add("]");
}

/** What the job came to: Report of core.ts. */
EXPORT(core_report) const char *core_report(void) {
    struct sim_result result;
    double low[AXIS_COUNT], high[AXIS_COUNT];
    sim_result(sim, &result);
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++) {
        low[axis] = result.min_steps[axis] / result.steps_per_mm[axis];
        high[axis] = result.max_steps[axis] / result.steps_per_mm[axis];
    }
    report_size = 0;
    add("{");
    add_number("seconds", (double)result.job_ticks / board.timer_hz);
    add_number("cutting_seconds", (double)result.cutting_ticks / board.timer_hz);
    add_number("rapid_seconds", (double)result.rapid_ticks / board.timer_hz);
    add_number("lines", (double)result.lines);
    add_numbers("min_mm", low);
    add_numbers("max_mm", high);
    add_numbers("max_speed_mm_s", result.max_speed_mm_s);
    add_numbers("max_accel_mm_s2", result.max_accel_mm_s2);
    add_number("max_step_rate_hz", result.max_step_rate_hz);
    add_errors();
    add_tool_changes();
    add_engraving();
    add("}");
    return report;
}

/* ---- what lines have set ---- */

/** Begin again: power-on state at core_axes(), machine coordinates. @return 0, or -1 */
EXPORT(core_rebuild) int core_rebuild(uint32_t axes) {
    rebuild_destroy(rebuild);
    rebuild = rebuild_create((uint8_t)axes);
    if (rebuild == NULL)
        return -1;
    rebuild_set_position(rebuild, axes_mm);
    return 0;
}

/** A row of `$#` with the values of core_axes(): rebuild_set_offset(). */
EXPORT(core_rebuild_offset) int core_rebuild_offset(int row) {
    return rebuild_set_offset(rebuild, row, axes_mm);
}

EXPORT(core_rebuild_line) int core_rebuild_line(const char *line, size_t size) {
    return rebuild_line(rebuild, line, size);
}

/** struct rebuild_state as JSON: Modes of core.ts. */
EXPORT(core_rebuild_report) const char *core_rebuild_report(void) {
    struct rebuild_state state;
    rebuild_state(rebuild, &state);
    report_size = 0;
    add("{");
    add_numbers("work_mm", state.work_mm);
    add_numbers("machine_mm", state.machine_mm);
    add_numbers("g92_mm", state.g92_mm);
    add_number("top_z_mm", state.top_z_mm);
    add_number("tool_length_mm", state.tool_length_mm);
    add_number("feed_mm_min", state.feed_mm_min);
    add_number("spindle_rpm", state.spindle_rpm);
    add_number("path_tolerance_mm", state.path_tolerance_mm);
    add("\"tool\":%d,\"motion_g10\":%d,\"path_g10\":%d,\"wcs_g10\":%d,", (int)state.tool, state.motion_g10,
        state.path_g10, state.wcs_g10);
    add("\"plane_g\":%u,\"units_g\":%u,\"distance_g\":%u,\"feed_mode_g\":%u,", state.plane_g, state.units_g,
        state.distance_g, state.feed_mode_g);
    add("\"spindle_m\":%u,\"coolant\":%u,\"arc_absolute\":%u,\"moved\":%u,\"stored\":%u}", state.spindle_m,
        state.coolant, state.arc_absolute, (unsigned)state.moved, state.stored);
    return report;
}
