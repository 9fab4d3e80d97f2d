/* SPDX-License-Identifier: MIT
 * The sender's side of a simulated job: bytes out, answers in, edges measured. */
#include "sim.h"

#include "expand.h"
#include "machine/parts.h"
#include "sim_script.h"
#include "sim_text.h"
#include "trace_write.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ANSWER_SIZE = 256, MAX_WRITERS = 4, MAX_MESSAGES = 1000, MAX_ROUNDS = 1 << 14, MAX_IDLE_ROUNDS = 4 };

#define RUN_ALL 1000000u /* events per round while a command waits for its answer */

/** A growing list. */
struct list {
    void *items;
    size_t count, room;
};

struct sim {
    struct host *host;
    struct host_board board;
    struct measure *measure;
    struct trace_writer *writers[MAX_WRITERS];
    size_t writer_count;

    struct sim_text text;
    bool expanded;         /* one line of the file may come several times */
    uint32_t lines_max;    /* of a program */
    size_t sent;           /* bytes of text.bytes the controller took */
    uint64_t sent_lines;   /* whole lines among them, and the one under way */
    bool at_line_start;    /* the next byte begins a line */
    uint64_t answered;     /* lines answered */
    uint32_t lines_before; /* that the controller had taken when the job began */
    bool keep_going, stopped, told_end, finished, closed;
    unsigned idle_rounds;
    uint64_t begin_ticks, end_ticks, pauses;
    bool dollar;          /* the line under way is a $ line */
    uint64_t alarm_ticks; /* of the alarm that has ended the job; 0: none */
    struct sim_script script;
    struct survey *survey; /* NULL: the job has not begun */
    bool surveys;          /* line by line */
    bool reset_asked;      /* by an event; the banner is still to come */
    double steps_per_mm[AXIS_COUNT];

    bool in_command; /* sim_command() waits */
    int command_answer;
    char answer[ANSWER_SIZE];
    size_t answer_size;
    struct list errors;       /* struct sim_error */
    struct list tool_changes; /* struct sim_tool_change */
    struct list messages;     /* char * */
};

/* ---- making and unmaking ---- */

static void *list_add(struct list *list, size_t item_size) {
    if (list->count == list->room) {
        size_t room = list->room == 0 ? 16 : 2 * list->room;
        void *grown = realloc(list->items, room * item_size);
        if (grown == NULL)
            return NULL;
        list->items = grown;
        list->room = room;
    }
    return (char *)list->items + item_size * list->count++;
}

static void listen(struct sim *sim);

struct sim *sim_create(const struct host_board *board) {
    struct sim *sim = calloc(1, sizeof *sim);
    if (sim == NULL)
        return NULL;
    sim->board = *board;
    sim->at_line_start = true;
    sim->lines_max = SIM_LINES_MAX;
    sim->host = host_create(board);
    sim->measure = sim->host != NULL ? measure_create(board->timer_hz) : NULL;
    if (sim->measure == NULL || !trace_add(host_trace(sim->host), measure_events, sim->measure)) {
        sim_destroy(sim);
        return NULL;
    }
    host_run(sim->host, RUN_ALL);
    listen(sim); /* the banner */
    return sim;
}

void sim_destroy(struct sim *sim) {
    if (sim == NULL)
        return;
    sim_close(sim);
    if (sim->host != NULL)
        host_destroy(sim->host);
    measure_destroy(sim->measure);
    survey_destroy(sim->survey);
    sim_text_free(&sim->text);
    script_free(&sim->script);
    for (size_t i = 0; i < sim->messages.count; i++)
        free(((char **)sim->messages.items)[i]);
    free(sim->messages.items);
    free(sim->errors.items);
    free(sim->tool_changes.items);
    free(sim);
}

/* ---- what the controller says ---- */

/* Number of the line in the file whose answer is the index-th, 0 for one before the first. */
static uint32_t file_line(const struct sim *sim, uint64_t index) {
    return index < sim->text.line_count ? sim->text.line_number[index] : 0;
}

static void add_error(struct sim *sim, uint32_t line, enum sim_error_kind kind, int code) {
    struct sim_error *error = list_add(&sim->errors, sizeof *error);
    if (error != NULL)
        *error = (struct sim_error){.line = line, .code = code, .kind = kind};
    if (!sim->keep_going || kind != SIM_ERROR)
        sim->stopped = true;
}

static void add_message(struct sim *sim, const char *text) {
    char *copy = sim->messages.count < MAX_MESSAGES ? malloc(strlen(text) + 1) : NULL;
    char **item = copy != NULL ? list_add(&sim->messages, sizeof *item) : NULL;
    if (item == NULL) {
        free(copy);
        return;
    }
    strcpy(copy, text);
    *item = copy;
}

static void begin_measure(struct sim *sim) {
    float steps_per_mm[AXIS_COUNT];
    const float *accel_mm_s2 = host_machine(sim->host)->settings.acceleration_mm_s2;
    host_steps_per_mm(sim->host, steps_per_mm);
    for (int axis = 0; axis < AXIS_COUNT; axis++)
        sim->steps_per_mm[axis] = (double)steps_per_mm[axis];
    measure_begin(sim->measure, sim->begin_ticks, sim->steps_per_mm);
    for (int axis = 0; axis < AXIS_COUNT; axis++)
        measure_expect_accel(sim->measure, axis, (double)accel_mm_s2[axis] * sim->steps_per_mm[axis]);
}

/* A $ line may have changed how far a step goes: for the figures that counts before the first step. */
static void take_scale(struct sim *sim) {
    char text[80];
    float steps_per_mm[AXIS_COUNT];
    bool same = true;
    host_steps_per_mm(sim->host, steps_per_mm);
    for (int axis = 0; axis < AXIS_COUNT; axis++)
        same = same && (double)steps_per_mm[axis] == sim->steps_per_mm[axis];
    if (same)
        return;
    struct host_counters counters;
    host_counters(sim->host, &counters);
    if (counters.step_events == 0) {
        begin_measure(sim);
        return;
    }
    snprintf(text, sizeof text, "[MSG:line %u changes steps/mm after motion: figures keep the first value]",
             (unsigned)file_line(sim, sim->answered));
    add_message(sim, text);
}

static void take_answer(struct sim *sim, int code) {
    if (sim->in_command) {
        sim->command_answer = code;
        sim->in_command = false;
    } else if (sim->answered >= sim->sent_lines) {
        add_error(sim, sim->answered > 0 ? file_line(sim, sim->answered - 1) : 0, SIM_SURPLUS, 0);
    } else {
        if (sim->survey != NULL)
            survey_answered(sim->survey, file_line(sim, sim->answered), code);
        if (code != 0)
            add_error(sim, file_line(sim, sim->answered), SIM_ERROR, code);
        if (sim->dollar)
            take_scale(sim);
        sim->answered++;
    }
}

static bool begins(const char *text, const char *with) {
    return strncmp(text, with, strlen(with)) == 0;
}

/* A reset by hand: nothing of the job is left in the controller, and a sender would stop here. */
static void take_banner(struct sim *sim) {
    if (!sim->reset_asked)
        return;
    sim->reset_asked = false;
    if (!sim->stopped)
        add_error(sim, file_line(sim, sim->answered), SIM_RESET, 0);
    sim->stopped = true;
    sim->sent_lines = sim->answered;
}

/* The job ends at the first one; the quiet after it is not a part of the job. */
static void take_alarm(struct sim *sim, int code) {
    if (sim->alarm_ticks == 0)
        sim->alarm_ticks = host_alarm_ticks(sim->host);
    add_error(sim, file_line(sim, sim->answered), SIM_ALARM, code);
}

static void take_line(struct sim *sim, const char *line) {
    if (strcmp(line, "ok") == 0)
        take_answer(sim, 0);
    else if (begins(line, "error:"))
        take_answer(sim, atoi(line + strlen("error:")));
    else if (begins(line, "ALARM:"))
        take_alarm(sim, atoi(line + strlen("ALARM:")));
    else if (begins(line, "[MSG:"))
        add_message(sim, line);
    else if (begins(line, "Grbl "))
        take_banner(sim);
}

static void take_bytes(struct sim *sim, const char *bytes, size_t count) {
    for (size_t i = 0; i < count; i++) {
        char c = bytes[i];
        if (c == '\n' || c == '\r') {
            sim->answer[sim->answer_size] = '\0';
            if (sim->answer_size > 0)
                take_line(sim, sim->answer);
            sim->answer_size = 0;
        } else if (sim->answer_size < ANSWER_SIZE - 1) {
            sim->answer[sim->answer_size++] = c;
        }
    }
}

static void listen(struct sim *sim) {
    char bytes[1024];
    size_t count;
    while ((count = host_read(sim->host, bytes, sizeof bytes)) > 0)
        take_bytes(sim, bytes, count);
}

/* ---- what is commanded ---- */

/* All there is to know about whether a round brought anything forward. */
struct mark {
    uint64_t sent, answered, ticks, timer_events;
};

static struct mark mark_now(const struct sim *sim) {
    struct host_counters counters;
    host_counters(sim->host, &counters);
    return (struct mark){sim->sent, sim->answered, host_time_ticks(sim->host), counters.timer_events};
}

static bool same_mark(struct mark a, struct mark b) {
    return a.sent == b.sent && a.answered == b.answered && a.ticks == b.ticks &&
           a.timer_events == b.timer_events;
}

int sim_command(struct sim *sim, const char *line) {
    size_t size = strlen(line), sent = 0;
    sim->in_command = true;
    unsigned idle_rounds = 0;
    while (sim->in_command && idle_rounds < MAX_IDLE_ROUNDS) {
        struct mark before = mark_now(sim);
        size_t took = 0;
        if (sent < size)
            took = host_write(sim->host, line + sent, size - sent);
        else if (sent == size)
            took = host_write(sim->host, "\n", 1);
        sent += took;
        host_run(sim->host, RUN_ALL);
        listen(sim);
        idle_rounds = took > 0 || !same_mark(before, mark_now(sim)) ? 0 : idle_rounds + 1;
    }
    bool answered = !sim->in_command;
    sim->in_command = false;
    return answered ? sim->command_answer : -1;
}

const char *sim_at(struct sim *sim, double t_s, const char *line) {
    return script_add(&sim->script, sim->host, t_s, line);
}

void sim_survey(struct sim *sim) {
    sim->surveys = true;
}

const struct survey *sim_surveyed(const struct sim *sim) {
    return sim->survey;
}

void sim_limit_lines(struct sim *sim, uint32_t lines_max) {
    sim->lines_max = lines_max;
}

/* @return 0, or -1 when memory is short */
static int load_program(struct sim *sim, const char *text, size_t size) {
    struct sim_text source;
    struct expand *expand = expand_create(text, size, EXPAND_AT_ZERO, sim->lines_max);
    if (expand == NULL || sim_text_make(&source, text, size) != 0) {
        expand_destroy(expand);
        return -1;
    }
    const int failed = sim_text_make_expanded(&sim->text, expand);
    sim->text.file_lines = source.file_lines;
    sim->text.percent_lines = source.percent_lines;
    sim->text.end = *expand_end(expand);
    sim->expanded = true;
    if (failed == 0 && expand_error(expand) != 0)
        add_error(sim, expand_error_line(expand), SIM_ERROR, expand_error(expand));
    sim_text_free(&source);
    expand_destroy(expand);
    return failed;
}

int sim_load(struct sim *sim, const char *text, size_t size, int keep_going) {
    sim->keep_going = keep_going != 0;
    if (tool_change_goes(host_machine(sim->host))) /* what is simulated has not been homed */
        (void)sim_command(sim, "$341=0");
    if ((expand_is_needed(text, size) ? load_program(sim, text, size)
                                      : sim_text_make(&sim->text, text, size)) != 0)
        return ENOMEM;
    if ((sim->survey = survey_create(sim->host, &sim->text, sim->surveys)) == NULL)
        return ENOMEM;
    sim->lines_before = host_machine(sim->host)->lines.count;
    trace_flush(host_trace(sim->host));
    sim->begin_ticks = sim->end_ticks = host_time_ticks(sim->host);
    begin_measure(sim);
    script_begin(&sim->script, sim->begin_ticks, sim->board.timer_hz);
    return 0;
}

static bool all_sent(const struct sim *sim) {
    return sim->stopped || sim->sent == sim->text.size;
}

/* A sender keeps a $ line back until nothing moves. Until then no more input comes, so what is planned
 * starts.
 */
static bool may_begin(struct sim *sim, const char *line) {
    while (sim_text_is_blank(*line)) /* strspn() of some libraries reads all of the text first */
        line++;
    sim->dollar = *line == '$';
    bool may = !sim->dollar || !host_is_busy(sim->host);
    host_input_follows(sim->host, may);
    return may;
}

/* Put the next line, or what is left of it, once everything before it is answered. */
static void feed(struct sim *sim) {
    if (all_sent(sim) || (sim->at_line_start && sim->answered < sim->sent_lines))
        return;
    const char *begin = sim->text.bytes + sim->sent;
    const char *end = (const char *)memchr(begin, '\n', sim->text.size - sim->sent) + 1;
    if (sim->at_line_start && !may_begin(sim, begin))
        return;
    size_t took = host_write(sim->host, begin, (size_t)(end - begin));
    if (took == 0)
        return;
    sim->sent += took;
    sim->sent_lines += sim->at_line_start;
    sim->at_line_start = took == (size_t)(end - begin);
}

/* Tell the controller, once, that what it has is all there is. */
static void tell_end(struct sim *sim) {
    if (sim->told_end || !all_sent(sim))
        return;
    sim->told_end = true;
    host_input_follows(sim->host, 0);
}

/* ---- the job ---- */

static void finish(struct sim *sim) {
    sim->finished = true;
    sim->end_ticks = sim->alarm_ticks != 0 ? sim->alarm_ticks : host_time_ticks(sim->host);
    trace_flush(host_trace(sim->host));
    measure_end(sim->measure, sim->end_ticks, host_dwells(sim->host));
}

static bool is_held(const struct sim *sim) {
    const char *state = host_state(sim->host);
    return begins(state, "Hold") || begins(state, "Door");
}

/* As an operator does, who has changed the tool. */
static void end_pause(struct sim *sim) {
    int32_t tool;
    if (!host_awaits_tool(sim->host, &tool)) {
        sim->pauses += host_write(sim->host, "~", 1);
        return;
    }
    if (host_write(sim->host, "~", 1) == 0)
        return;
    struct sim_tool_change *change = list_add(&sim->tool_changes, sizeof *change);
    if (change != NULL)
        *change = (struct sim_tool_change){
            .t_s = (double)(host_time_ticks(sim->host) - sim->begin_ticks) / sim->board.timer_hz,
            .line = file_line(sim, sim->answered),
            .tool = tool,
        };
}

/* Nothing happens by itself any more. A program pause waits for the operator, and what is stopped or held for
 * an event; anything else is a controller that is stuck. */
static void prod(struct sim *sim) {
    if (host_is_paused(sim->host)) {
        end_pause(sim);
        return;
    }
    if (script_next_ticks(&sim->script) != UINT64_MAX) {
        host_run_until(sim->host, script_next_ticks(&sim->script));
        return;
    }
    if (++sim->idle_rounds < MAX_IDLE_ROUNDS)
        return;
    if (!sim->stopped)
        add_error(sim, file_line(sim, sim->answered), is_held(sim) ? SIM_HELD : SIM_NO_ANSWER, 0);
    finish(sim);
}

static void one_round(struct sim *sim, uint64_t max_events) {
    struct mark before = mark_now(sim);
    feed(sim);
    tell_end(sim);
    enum host_wait wait = host_run_before(sim->host, max_events, script_next_ticks(&sim->script));
    sim->reset_asked |= script_perform(&sim->script, sim->host);
    listen(sim);
    bool done = !sim->stopped && sim->told_end && sim->answered == sim->sent_lines && !is_held(sim);
    if (wait == HOST_IDLE && done)
        finish(sim);
    else if (wait != HOST_TIME && same_mark(before, mark_now(sim)))
        prod(sim);
    else
        sim->idle_rounds = 0;
}

int sim_run(struct sim *sim, uint64_t max_events) {
    struct host_counters counters;
    host_counters(sim->host, &counters);
    uint64_t end = counters.step_events + max_events;
    for (unsigned round = 0; round < MAX_ROUNDS && !sim->finished && counters.step_events < end; round++) {
        one_round(sim, end - counters.step_events);
        host_counters(sim->host, &counters);
    }
    return !sim->finished;
}

/* ---- results ---- */

void sim_progress(const struct sim *sim, uint64_t *lines_done, uint64_t *lines_total) {
    *lines_done = sim->expanded ? sim->answered : sim->answered > 0 ? file_line(sim, sim->answered - 1) : 0;
    *lines_total = sim->expanded ? sim->text.line_count : sim->text.file_lines;
}

uint32_t sim_line_now(const struct sim *sim) {
    uint32_t moved = host_line_now(sim->host) - sim->lines_before;
    if (sim->finished)
        return sim->answered > 0 ? file_line(sim, sim->answered - 1) : 0;
    return moved >= 1 && moved <= sim->sent_lines ? file_line(sim, moved - 1) : 0;
}

size_t sim_error_count(const struct sim *sim) {
    return sim->errors.count;
}

struct sim_error sim_error_at(const struct sim *sim, size_t index) {
    return index < sim->errors.count ? ((struct sim_error *)sim->errors.items)[index] : (struct sim_error){0};
}

size_t sim_event_count(const struct sim *sim) {
    return sim->script.count;
}

struct script_event sim_event_at(const struct sim *sim, size_t index) {
    return index < sim->script.count ? sim->script.items[index].event : (struct script_event){0};
}

size_t sim_tool_changes(const struct sim *sim, const struct sim_tool_change **out) {
    *out = sim->tool_changes.items;
    return sim->tool_changes.count;
}

size_t sim_message_count(const struct sim *sim) {
    return sim->messages.count;
}

const char *sim_message_at(const struct sim *sim, size_t index) {
    return index < sim->messages.count ? ((char **)sim->messages.items)[index] : "";
}

static void place_tool(const struct sim *sim, struct sim_result *out) {
    const struct machine *machine = host_machine(sim->host);
    joints_tool_mm(&machine->drive.joints, &machine->drive.motion, out->position_steps, out->position_mm);
    if (machine->settings.kinematics != KINEMATICS_CARTESIAN && sim->survey != NULL)
        survey_box(sim->survey, out->min_mm, out->max_mm); /* motors do not say where the tool was */
}

void sim_result(const struct sim *sim, struct sim_result *out) {
    struct measured measured;
    int32_t shift[AXIS_COUNT];
    host_shift_steps(sim->host, shift);
    measure_result(sim->measure, &measured);
    *out = (struct sim_result){
        .job_ticks = (sim->finished ? sim->end_ticks : host_time_ticks(sim->host)) - sim->begin_ticks,
        .cutting_ticks = measured.cutting_ticks,
        .rapid_ticks = measured.rapid_ticks,
        .lines = sim->text.file_lines,
        .percent_lines = sim->text.percent_lines,
        .program_end = sim->text.end,
        .pauses = sim->pauses,
    };
    host_counters(sim->host, &out->counters);
    host_position_steps(sim->host, out->position_steps);
    for (int axis = 0; axis < AXIS_COUNT; axis++) {
        double steps_per_mm = sim->steps_per_mm[axis];
        out->steps_per_mm[axis] = steps_per_mm;
        out->min_mm[axis] = measured.min_steps[axis] / steps_per_mm;
        out->max_mm[axis] = measured.max_steps[axis] / steps_per_mm;
        out->steps_total[axis] = measured.steps_total[axis];
        out->measured_steps[axis] = measured.position_steps[axis] + shift[axis];
        out->min_steps[axis] = measured.min_steps[axis];
        out->max_steps[axis] = measured.max_steps[axis];
        out->max_speed_mm_s[axis] = measured.max_speed_steps_s[axis] / steps_per_mm;
        out->max_accel_mm_s2[axis] = measured.max_accel_steps_s2[axis] / steps_per_mm;
        out->accel_window_s[axis] = measured.accel_window_s[axis];
        uint64_t interval = measured.min_interval_ticks[axis];
        double rate_hz = interval > 0 ? (double)sim->board.timer_hz / (double)interval : 0.0;
        out->max_step_rate_hz = rate_hz > out->max_step_rate_hz ? rate_hz : out->max_step_rate_hz;
    }
    place_tool(sim, out);
}

int sim_sample_every(struct sim *sim, double interval_ms) {
    measure_sample_every(sim->measure, interval_ms);
    return 0;
}

size_t sim_samples(const struct sim *sim, const struct path_sample **out) {
    return measure_samples(sim->measure, out);
}

/* ---- trace files ---- */

static int add_writer(struct sim *sim, struct trace_writer *writer, int error) {
    if (writer == NULL)
        return error;
    if (sim->writer_count == MAX_WRITERS || !trace_writer_attach(writer, host_trace(sim->host))) {
        trace_writer_close(writer);
        return EMFILE;
    }
    sim->writers[sim->writer_count++] = writer;
    return 0;
}

int sim_trace_csv(struct sim *sim, const char *path) {
    int error;
    struct trace_writer *writer = trace_csv_open(path, sim->board.timer_hz, &error);
    return add_writer(sim, writer, error);
}

int sim_trace_vcd(struct sim *sim, const char *path, const char *const names[2 * AXIS_COUNT]) {
    int error;
    struct trace_writer *writer = trace_vcd_open(path, sim->board.timer_hz, sim->board.step_pulse_ns,
                                                 sim->board.dir_setup_ns, names, &error);
    return add_writer(sim, writer, error);
}

int sim_trace_raw(struct sim *sim, const char *path) {
    int error;
    struct trace_writer *writer = trace_raw_open(path, sim->board.timer_hz, &error);
    return add_writer(sim, writer, error);
}

int sim_close(struct sim *sim) {
    if (sim->closed)
        return 0;
    sim->closed = true;
    int error = 0;
    if (sim->host != NULL)
        trace_flush(host_trace(sim->host));
    for (size_t i = 0; i < sim->writer_count; i++) {
        int failed = trace_writer_close(sim->writers[i]);
        error = error != 0 ? error : failed;
    }
    bool lost = (sim->measure != NULL && measure_samples_lost(sim->measure)) ||
                (sim->survey != NULL && engraving_lost(survey_engraving(sim->survey)));
    return error == 0 && lost ? ENOMEM : error;
}
