/* SPDX-License-Identifier: MIT */
#include "survey.h"

#include "base/duty.h"
#include "gcode/arc.h"
#include "gcode/block.h"
#include "gcode/resolve.h"
#include "machine/parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STRETCH_S   0.0015f       /* shorter ones have no speed worth the name */
#define NEARLY      0.995f        /* of its maximum rate: a motor runs at it */
#define GRAIN_STEPS (1.0 / 256.0) /* how exactly the way between two ends of segments is known */

enum { MAX_ARCS = 1000 };

/* What moved since a moment, long enough to have a speed: a segment's ends are known to 1/256 step only. */
struct stretch {
    uint32_t index; /* of the line */
    float time_s;
    double from_steps[AXIS_COUNT];
};

struct survey {
    struct host *host;
    const struct sim_text *text;
    uint32_t first;                                /* number that the controller gives to the first line */
    double at_mm[AXIS_COUNT];                      /* where the next line begins, programmed */
    double min_mm[AXIS_COUNT], max_mm[AXIS_COUNT]; /* where the tool has been */
    struct survey_line *lines;                     /* NULL: not wanted */
    size_t count;
    struct engraving *engraving;
    uint64_t begin_ticks;
    struct survey_arc arcs[MAX_ARCS];
    size_t arc_count;
    struct stretch stretch;
};

static void watch(void *ctx, const struct host_segment *moved);

static void keep_position(struct survey *survey) {
    memcpy(survey->at_mm, host_machine(survey->host)->interp.gcode.position_mm, sizeof survey->at_mm);
}

struct survey *survey_create(struct host *host, const struct sim_text *text, bool has_lines) {
    struct survey *survey = calloc(1, sizeof *survey);
    if (survey == NULL)
        return NULL;
    *survey = (struct survey){.host = host, .text = text, .begin_ticks = host_time_ticks(host)};
    /* Settings were sent as lines, too: the controller has counted them. */
    survey->first = host_machine(host)->lines.count + 1;
    survey->engraving = engraving_create((size_t)text->line_count);
    if (has_lines) {
        survey->count = (size_t)text->file_lines + 1;
        survey->lines = calloc(survey->count, sizeof *survey->lines);
    }
    if (survey->engraving == NULL || (has_lines && survey->lines == NULL)) {
        survey_destroy(survey);
        return NULL;
    }
    keep_position(survey);
    memcpy(survey->min_mm, survey->at_mm, sizeof survey->min_mm);
    memcpy(survey->max_mm, survey->at_mm, sizeof survey->max_mm);
    host_watch_segments(host, watch, survey);
    return survey;
}

void survey_destroy(struct survey *survey) {
    if (survey == NULL)
        return;
    engraving_destroy(survey->engraving);
    free(survey->lines);
    free(survey);
}

/* NULL: no line of the file */
static struct survey_line *row_of(struct survey *survey, uint32_t line) {
    return line > 0 && line < survey->count ? &survey->lines[line] : NULL;
}

/* The line has been here. */
static void reach(struct survey_line *row, uint32_t line, const double at_mm[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        float mm = (float)at_mm[ax];
        if (row->line == 0 || mm < row->min_mm[ax])
            row->min_mm[ax] = mm;
        if (row->line == 0 || mm > row->max_mm[ax])
            row->max_mm[ax] = mm;
    }
    row->line = line;
}

/* As the feed counts: along X Y Z; A B C when only they move. */
static double counted_mm(const double from_mm[AXIS_COUNT], const double to_mm[AXIS_COUNT]) {
    double linear_sq = 0.0, rotary_sq = 0.0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        double way = to_mm[ax] - from_mm[ax];
        *(ax < AXIS_A ? &linear_sq : &rotary_sq) += way * way;
    }
    return sqrt(linear_sq > 0.0 ? linear_sq : rotary_sq);
}

static uint32_t at_rate(const struct motion_limits *limits, const struct stretch *stretch,
                        const double to_steps[AXIS_COUNT]) {
    uint32_t motors = 0;
    for (unsigned ax = 0; ax < limits->axis_count; ax++) {
        double mm = (to_steps[ax] - stretch->from_steps[ax]) / (double)limits->steps_per_mm[ax];
        if (fabs(mm) >= (double)(NEARLY * limits->max_rate_mm_s[ax] * stretch->time_s))
            motors |= 1u << ax;
    }
    return motors;
}

/* The part of the measured speed that is sure. By the grain of the ends a motor at its maximum rate seems
 * faster than that; what is more than the grain stays, because it would be true. */
static float sure_part(const struct motion_limits *limits, const struct stretch *stretch,
                       const double to_steps[AXIS_COUNT]) {
    double part = 1.0;
    for (unsigned ax = 0; ax < limits->axis_count; ax++) {
        double way_steps = fabs(to_steps[ax] - stretch->from_steps[ax]);
        double most_steps =
            (double)(limits->max_rate_mm_s[ax] * limits->steps_per_mm[ax]) * (double)stretch->time_s;
        if (way_steps > most_steps && way_steps <= most_steps + GRAIN_STEPS)
            part = fmin(part, most_steps / way_steps);
    }
    return (float)part;
}

static void tool_mm(const struct survey *survey, const double steps[AXIS_COUNT], double mm[AXIS_COUNT]) {
    const struct machine *machine = host_machine(survey->host);
    const struct kinematics *kinematics = &machine->drive.joints.kinematics;
    double joints[AXIS_COUNT];
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        joints[ax] = steps[ax] / (double)machine->drive.motion.plan.limits.steps_per_mm[ax];
    kinematics->ops->forward(kinematics, joints, mm);
}

/* The stretch up to here counts when it is long enough, or while it is all there is of its line. */
static void judge(struct survey *survey, struct survey_line *row, const double to_steps[AXIS_COUNT],
                  const double to_mm[AXIS_COUNT]) {
    struct stretch *stretch = &survey->stretch;
    bool is_all = row->time_s == stretch->time_s;
    double from_mm[AXIS_COUNT];
    if (stretch->time_s < STRETCH_S && !is_all)
        return;
    tool_mm(survey, stretch->from_steps, from_mm);
    const struct motion_limits *limits = &host_machine(survey->host)->drive.motion.plan.limits;
    float mm_s = (float)counted_mm(from_mm, to_mm) / stretch->time_s * sure_part(limits, stretch, to_steps);
    /* A first stretch that is too short gives a rough speed; the next one replaces it, and only then the
     * highest counts. */
    row->reached_mm_s = is_all || mm_s > row->reached_mm_s ? mm_s : row->reached_mm_s;
    row->at_rate |= at_rate(limits, stretch, to_steps);
    if (stretch->time_s >= STRETCH_S)
        stretch->time_s = 0.0f;
}

static void take_speed(struct survey *survey, uint32_t index, const struct host_segment *moved,
                       const double to_mm[AXIS_COUNT]) {
    struct stretch *stretch = &survey->stretch;
    struct survey_line *row = row_of(survey, survey->text->line_number[index]);
    if (row == NULL)
        return;
    if (stretch->time_s == 0.0f || stretch->index != index) {
        *stretch = (struct stretch){.index = index};
        memcpy(stretch->from_steps, moved->from_steps, sizeof stretch->from_steps);
    }
    float time_s = (float)moved->segment->duration_ns * 1e-9f;
    stretch->time_s += time_s;
    row->time_s += time_s;
    judge(survey, row, moved->to_steps, to_mm);
}

/* A segment says what its cut burns, and the step interrupt whether the beam may be on. */
static void take_burnt(struct survey *survey, uint32_t index, const struct host_segment *moved,
                       const double to_mm[AXIS_COUNT]) {
    const struct machine *machine = host_machine(survey->host);
    const struct segment *segment = moved->segment;
    if ((segment->flags & SEGMENT_CUT) == 0 || machine->drive.step.beam != STEP_BEAM_ALLOWED)
        return;
    double begun_s =
        (double)(host_time_ticks(survey->host) - survey->begin_ticks) / (double)machine->board.timer_hz;
    struct engraving_part part = {
        .index = index,
        .line = survey->text->line_number[index],
        .time_s = segment->duration_ns * 1e-9,
        .duty = (segment->duty[0] + segment->duty[1]) * 0.5 / (double)DUTY_FULL,
    };
    part.end_s = begun_s + part.time_s;
    tool_mm(survey, moved->from_steps, part.from_mm);
    memcpy(part.to_mm, to_mm, sizeof part.to_mm);
    part.length_mm = counted_mm(part.from_mm, part.to_mm);
    engraving_take(survey->engraving, &part);
}

/* The modes of the newest line are those of its move. */
static void take_modes(struct survey *survey) {
    const struct machine *machine = host_machine(survey->host);
    const struct gcode_modal *modal = &machine->interp.gcode.modal;
    bool by_minute = modal->feed_mode == FEED_PER_MIN;
    engraving_line(survey->engraving, machine->lines.count - survey->first, modal->spindle == SPINDLE_CW,
                   by_minute ? modal->feed_mm_s : 0.0f);
}

static void watch(void *ctx, const struct host_segment *moved) {
    struct survey *survey = ctx;
    uint32_t index = moved->segment->line - survey->first;
    if ((moved->segment->flags & SEGMENT_DWELL) != 0 || index >= survey->text->line_count)
        return;
    double to_mm[AXIS_COUNT];
    tool_mm(survey, moved->to_steps, to_mm);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        survey->min_mm[ax] = fmin(survey->min_mm[ax], to_mm[ax]);
        survey->max_mm[ax] = fmax(survey->max_mm[ax], to_mm[ax]);
    }
    take_speed(survey, index, moved, to_mm);
    if (index + survey->first == host_machine(survey->host)->lines.count)
        take_modes(survey); /* its answer is still to be read */
    take_burnt(survey, index, moved, to_mm);
}

/* The points of a curve that the controller compares with the travel. */
static void reach_curve(struct survey *survey, struct survey_line *row, uint32_t line,
                        const struct gcode_move *move) {
    double tolerance_mm = (double)host_machine(survey->host)->settings.arc_tolerance_mm;
    double point_mm[AXIS_COUNT];
    struct arc arc;
    struct spline spline;
    if (move->motion == MOTION_ARC_CW || move->motion == MOTION_ARC_CCW) {
        arc_begin(&arc, survey->at_mm, move, tolerance_mm);
        while (arc_next(&arc, point_mm))
            reach(row, line, point_mm);
    } else if (move->motion == MOTION_CUBIC || move->motion == MOTION_QUADRATIC) {
        spline_begin(&spline, survey->at_mm, move, tolerance_mm);
        while (spline_next(&spline, point_mm))
            reach(row, line, point_mm);
    }
}

static void take_move(struct survey *survey, uint32_t line) {
    struct survey_line *row = row_of(survey, line);
    struct gcode_move move;
    if (row == NULL || !host_take_move(survey->host, &move))
        return;
    reach(row, line, move.target_mm);
    reach_curve(survey, row, line, &move);
    if (move.via || move.motion == MOTION_CYCLE || move.motion == MOTION_THREAD)
        reach(row, line, move.via_mm);
    row->rapid |= move.motion == MOTION_RAPID;
    row->asked_mm_s = move.feed_mm_s > row->asked_mm_s ? move.feed_mm_s : row->asked_mm_s;
}

/* Where the line would lead if it were straight. @return false: it could not be resolved either */
static bool resolve_as_line(const struct gcode_state *state, const struct gcode_block *arc,
                            struct gcode_command *command) {
    struct gcode_block block = *arc;
    block.groups |= 1u << GROUP_MOTION;
    block.value[GROUP_MOTION] = MOTION_LINEAR;
    block.words &= ~(WORD_BIT('I') | WORD_BIT('J') | WORD_BIT('K') | WORD_BIT('R') | WORD_BIT('P'));
    return gcode_resolve(state, &block, command) == STATUS_OK;
}

/* What is wrong with the arc that the controller has just refused. */
static void take_arc(struct survey *survey, uint32_t line) {
    const struct machine *machine = host_machine(survey->host);
    const struct gcode_state *state = &machine->interp.gcode;
    struct gcode_command command;
    struct gcode_block block;
    if (survey->arc_count == MAX_ARCS || gcode_parse(machine->lines.reader.text, &block) != STATUS_OK)
        return;
    unsigned motion =
        block_has_group(&block, GROUP_MOTION) ? BLOCK_MOTION(block.value[GROUP_MOTION]) : state->modal.motion;
    if ((motion != MOTION_ARC_CW && motion != MOTION_ARC_CCW) || !resolve_as_line(state, &block, &command))
        return;
    const uint8_t *axes = arc_plane_axes[command.next.plane];
    double unit_mm = command.next.inches ? MM_PER_INCH : 1.0;
    struct survey_arc *arc = &survey->arcs[survey->arc_count++];
    *arc = (struct survey_arc){.line = line, .plane = command.next.plane, .unit_mm = unit_mm};
    arc->by_radius = (block.words & WORD_BIT('R')) != 0;
    for (unsigned i = 0; i < 2; i++) {
        char letter = (char)(arc->by_radius ? 'R' : 'I' + axes[i]);
        bool given = (block.words & WORD_BIT(letter)) != 0;
        /* G90.1: the centre is in work coordinates; the arc is described from where it starts. */
        double offset_mm = state->offsets.wcs_mm[command.next.wcs][axes[i]] + state->offsets.g92_mm[axes[i]];
        if (axes[i] == AXIS_Z)
            offset_mm += state->offsets.tool_length_mm;
        arc->way_mm[i] = command.move.target_mm[axes[i]] - state->position_mm[axes[i]];
        arc->word_mm[i] = given ? block.number[WORD(letter)] * unit_mm : 0.0;
        arc->center_mm[i] = arc->word_mm[i];
        if (command.next.arc_absolute)
            arc->center_mm[i] += offset_mm - state->position_mm[axes[i]];
    }
}

void survey_answered(struct survey *survey, uint32_t line, int status) {
    if (status == STATUS_OK)
        take_move(survey, line);
    else if (status == STATUS_BAD_TARGET || status == STATUS_ARC_RADIUS)
        take_arc(survey, line);
    take_modes(survey);
    keep_position(survey);
}

void survey_box(const struct survey *survey, double min_mm[AXIS_COUNT], double max_mm[AXIS_COUNT]) {
    memcpy(min_mm, survey->min_mm, sizeof survey->min_mm);
    memcpy(max_mm, survey->max_mm, sizeof survey->max_mm);
}

const struct engraving *survey_engraving(const struct survey *survey) {
    return survey->engraving;
}

size_t survey_lines(const struct survey *survey, const struct survey_line **out) {
    *out = survey->lines;
    return survey->count;
}

size_t survey_arcs(const struct survey *survey, const struct survey_arc **out) {
    *out = survey->arcs;
    return survey->arc_count;
}
