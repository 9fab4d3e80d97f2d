/* SPDX-License-Identifier: MIT */
#include "motion/planner.h"

#include "base/debug.h"
#include "motion/kinematics/kinematics.h"

#include <string.h>

#define ROUNDING_MM     0.003f /* twice that of a file with 4 decimals of an inch */
#define REDUCE_MOST     0.6f   /* of the tolerance, to come up to that */
#define REDUCE_PART     0.3f   /* of the tolerance is for leaving out points, the rest for rounding corners */
#define LEAST_TOLERANCE 0.5f   /* of the tolerance is left, however much of it an arc's chords take */
#define JERK_PART       0.25f  /* ... and this for limited jerk */
#define LEAST_FILTER_S  0.002f
#define CURVE_PART                                                                                           \
    0.045f /* of the tolerance is how far a segment may lie beside its curve, on top of it                   \
            */
#define CURVE_S         0.002f /* so long a segment does at 500 mm/s2 and 0.01 mm */
#define SHORT_CURVE_S   0.0005f
#define CUBE_ROOT_STEPS 48
#define LEAST_CHORD_MM  2e-5f /* a shorter one has no direction in float32 */
#define RAPID_MM_S      1e15f /* its square still is a float */
#define LEAST_MERGE_MM  1.0f

void plan_reset(struct plan *plan, const int32_t position_steps[AXIS_COUNT]) {
    kinematics_position_mm(position_steps, plan->limits.steps_per_mm, plan->position_mm);
    reduce_reset(&plan->reduce, plan->position_mm);
    path_reset(&plan->path);
    plan->timing.known = plan->timing.settled = 0;
}

/* x^3 = c, 0 < c <= 1. Newton's steps come from above; libm's bits are not the same everywhere. */
static float cube_root(float c) {
    float x = 1.0f;
    for (int i = 0; i < CUBE_ROOT_STEPS; i++)
        x -= (x - c / (x * x)) * (1.0f / 3.0f);
    return x;
}

/* Averaging over T = 2 k A / J limits the jerk, and cuts curves by up to k |A| T^2 / 24, |A| being that of X,
 * Y and Z at once. The part k of the acceleration that is used makes that fit: k^3 = 6 e J^2 / (|A| A^2). */
static void fit_filter(struct plan *plan) {
    struct motion_limits *limits = &plan->limits;
    float most = 0.0f, sum = 0.0f, part = 1.0f, jerk = limits->jerk_mm_s3;
    float room_mm = JERK_PART * limits->junction_deviation_mm;
    for (unsigned ax = 0; ax < limits->axis_count; ax++) {
        most = most_f(most, limits->accel_mm_s2[ax]);
        sum += ax <= AXIS_Z ? limits->accel_mm_s2[ax] * limits->accel_mm_s2[ax] : 0.0f;
    }
    plan->filter_s = plan->filter_mm = 0.0f;
    if (jerk <= 0.0f)
        return;
    float all = sqrtf(sum), cube = 6.0f * room_mm / all * (jerk / most) * (jerk / most);
    if (room_mm > 0.0f && cube < 1.0f)
        part = cube_root(cube);
    plan->filter_s = most_f(2.0f * part * most / jerk, LEAST_FILTER_S);
    float square = plan->filter_s * plan->filter_s * (1.0f / 24.0f);
    if (room_mm > 0.0f && part * all * square > room_mm)
        part = room_mm / (all * square);
    plan->filter_mm = part * all * square;
    for (unsigned ax = 0; ax < limits->axis_count; ax++)
        limits->accel_mm_s2[ax] *= part;
}

/* The chord of a curve with the acceleration |A|, that of X, Y and Z at once, is up to |A| T^2 / 8 beside it.
 */
static float fit_curve(const struct motion_limits *limits) {
    float sum = 0.0f;
    for (unsigned ax = 0; ax <= AXIS_Z && ax < limits->axis_count; ax++)
        sum += limits->accel_mm_s2[ax] * limits->accel_mm_s2[ax];
    float time_s = sqrtf(8.0f * CURVE_PART * limits->junction_deviation_mm / sqrtf(sum));
    return least_f(CURVE_S, most_f(time_s, SHORT_CURVE_S));
}

/* Points are left out so that the look-ahead reaches far enough, and no farther: a report names the first
 * move of a chord, and a job is resumed there. With half of the pieces it reaches to where every axis can
 * stop. */
static float fit_merge(const struct motion_limits *limits) {
    float way_mm = 0.0f;
    for (unsigned ax = 0; ax < limits->axis_count; ax++)
        way_mm = most_f(way_mm, limits->max_rate_mm_s[ax] * limits->max_rate_mm_s[ax] /
                                    (2.0f * limits->accel_mm_s2[ax]));
    return most_f(LEAST_MERGE_MM, way_mm * (2.0f / (float)PLAN_SIZE));
}

void plan_set_limits(struct plan *plan, const struct motion_limits *limits) {
    plan->limits = *limits;
    fit_filter(plan);
    plan->curve_s = fit_curve(&plan->limits);
    plan->merge_mm = fit_merge(&plan->limits);
    path_set_limits(&plan->path, &plan->limits);
}

uint32_t plan_free(const struct plan *plan) {
    const struct path *path = &plan->path;
    uint32_t chords = (plan->reduce.open ? 2u : 1u) + (path->waits ? 1u : 0u);
    uint32_t used = path->head - path->kept + path->newest - path->blended + PLAN_BURST * chords;
    if (used >= PLAN_SIZE || path->stop_head - path->stop_kept >= PATH_STOPS - 1)
        return 0;
    return PLAN_SIZE - used;
}

/* How far a point that is left out may lie from the chord: points are rounded when they are written, and what
 * is less than that rounding would make every chord end at another error of it. */
static float reduce_mm(float tolerance_mm) {
    return most_f(REDUCE_PART * tolerance_mm, least_f(REDUCE_MOST * tolerance_mm, ROUNDING_MM));
}

/* Speed along a chord. The feed counts along X Y Z; the other axes keep up (RS274/NGC 2.1.2.5). */
static float asked_mm_s(const struct motion_line *line, const vec *chord, float length_mm) {
    float x_mm = (*chord)[AXIS_X], y_mm = (*chord)[AXIS_Y], z_mm = (*chord)[AXIS_Z];
    if (line->duration_s > 0.0f)
        return length_mm / line->duration_s;
    if ((line->flags & MOTION_FLAG_RAPID) != 0)
        return RAPID_MM_S;
    float linear_mm = sqrtf(x_mm * x_mm + y_mm * y_mm + z_mm * z_mm);
    return linear_mm > 0.0f ? line->feed_mm_s * (length_mm / linear_mm) : line->feed_mm_s;
}

void plan_close(struct plan *plan) {
    struct reduce *reduce = &plan->reduce;
    if (!reduce->open)
        return;
    float length_mm = vec_length(reduce->chord);
    if (length_mm < LEAST_CHORD_MM) {
        reduce->open = reduce->aimed = reduce->merged = false; /* the next chord begins where this one did */
        return;
    }
    struct chord_info info = {.asked_mm_s = asked_mm_s(&plan->newest, &reduce->chord, length_mm),
                              .tube_mm = plan->tolerance_mm -
                                         (reduce->merged ? reduce_mm(plan->tolerance_mm) : 0.0f),
                              .line = plan->first_line,
                              .note = plan->newest.note,
                              .flags = plan->newest.flags};
    reduce_close(reduce);
    path_chord(&plan->path, &reduce->chord, length_mm, &info);
}

/* May the new move belong to the same chord as the newest one? */
static bool is_alike(const struct motion_line *a, const struct motion_line *b) {
    return a->feed_mm_s == b->feed_mm_s && a->flags == b->flags && a->note == b->note &&
           a->tolerance_mm == b->tolerance_mm && a->spent_mm == b->spent_mm && a->duration_s == 0.0f &&
           b->duration_s == 0.0f;
}

static bool leads_nowhere(const struct plan *plan, const struct motion_line *line) {
    bool same = true;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        same = same && line->target_mm[ax] == plan->position_mm[ax];
    return same;
}

static void add_line(struct plan *plan, const struct motion_line *line) {
    float tolerance_mm = most_f(plan->limits.junction_deviation_mm, line->tolerance_mm) - plan->filter_mm;
    tolerance_mm = most_f(tolerance_mm, 0.0f);
    tolerance_mm = most_f(tolerance_mm - line->spent_mm, LEAST_TOLERANCE * tolerance_mm);
    float left_out_mm = reduce_mm(tolerance_mm);
    bool begins = !plan->reduce.open;
    if (!is_alike(&plan->newest, line) ||
        !reduce_accepts(&plan->reduce, line->target_mm, left_out_mm, plan->merge_mm)) {
        plan_close(plan);
        begins = true;
        plan->tolerance_mm = tolerance_mm;
        (void)reduce_accepts(&plan->reduce, line->target_mm, left_out_mm, plan->merge_mm);
    }
    if (begins)
        plan->first_line = line->line;
    plan->newest = *line;
    plan->tolerance_mm = tolerance_mm;
    memcpy(plan->position_mm, line->target_mm, sizeof plan->position_mm);
}

void plan_line(struct plan *plan, const struct motion_line *line) {
    plan->moves_total++;
    if (!leads_nowhere(plan, line))
        add_line(plan, line);
    if ((line->flags & MOTION_FLAG_EXACT_STOP) != 0)
        plan_end(plan, false);
    DEBUG(DEBUG_MOTION, "move: line, pieces waiting", line->line, path_count(&plan->path));
}

void plan_end(struct plan *plan, bool may_go_on) {
    int32_t steps[AXIS_COUNT] = {0};
    plan_close(plan);
    kinematics_target_steps(plan->position_mm, plan->limits.steps_per_mm, plan->limits.axis_count, steps);
    path_end(&plan->path, steps, may_go_on);
}

void plan_set_override(struct plan *plan, float feed, float rapid) {
    plan->timing.feed_sq = feed * feed;
    plan->timing.rapid_sq = rapid * rapid;
    plan->timing.whole = true;
}
