/* SPDX-License-Identifier: MIT */
#include "motion/fit.h"

#include "motion/history.h"

#define SHAPE_PART 0.5f  /* of the tolerance is for limited jerk and input shaping together ... */
#define JERK_PART  0.25f /* ... and this for limited jerk, where there is both */
#define TURNING    1.15f /* what the mean cuts off a bend where the speed changes, and where not: 1 */
#define JUMP       1.96f /* of 2: so far two accelerations within one mean may differ, times that in bends */
#define CALM       0.05f /* ... and this is least before and after all of it on a straight way */
#define ROUNDING   1e-4f /* relative */
#define NO_LIMIT   1e15f
#define MIN_MEAN_S 0.002f
#define MOST_SUM_S 131072.0f /* of 140,737: more of a step's 65536 parts times ns do not fit 63 bits */
#define MAX_MEAN_S                                                                                           \
    1.0f /* what an axis is late by, and history.c counts in 31 bits of ns: with shapers, too */
/* How far a segment may lie off its curve, as a part of the tolerance and on top of it. */
#define CURVE_PART      0.045f
#define CURVE_S         0.002f /* this long a segment does at 500 mm/s2 and 0.01 mm */
#define SHORT_CURVE_S   0.0005f
#define CUBE_ROOT_STEPS 48
#define MIN_MERGE_MM    1.0f

/* x^3 = c, 0 < c <= 1. Newton's steps come from above; libm's bits are not the same everywhere. */
static float cube_root(float c) {
    float x = 1.0f;
    for (int i = 0; i < CUBE_ROOT_STEPS; i++)
        x -= (x - c / (x * x)) * (1.0f / 3.0f);
    return x;
}

/* A mean is a sum of places times ns over a window (motion/history.c), hz window^2 / 2 steps times s at most.
 */
static float longest_mean_s(const struct motion_limits *limits, float delay_s) {
    float hz = 1.0f;
    for (unsigned ax = 0; ax < limits->axis_count; ax++)
        hz = max_f(hz, limits->max_rate_mm_s[ax] * limits->steps_per_mm[ax]);
    hz *= limits->coupled ? 2.0f : 1.0f; /* the sum of two axes */
    return max_f(min_f(MAX_MEAN_S, sqrtf(2.0f * MOST_SUM_S / hz) - delay_s), MIN_MEAN_S);
}

/* Averaging over T = 2 k A / J limits the jerk, and cuts curves by up to a T^2 / 24 for an acceleration a
 * across the path. The part k of the acceleration that is used makes that fit: k^3 = 6 e J^2 / (a A^2), a = k
 * A. With shapers, whose moments differ, a is that of X, Y and Z together. T is at most longest_s,
 * k then less.
 * @param room  part of the tolerance @param *across_mm_s2  becomes the greatest acceleration across the path
 * @return T; the accelerations become those that are used */
static float fit_jerk(struct motion_limits *limits, float room, bool shaped, float longest_s,
                      float *across_mm_s2) {
    float most = 0.0f, sum = 0.0f, part = 1.0f, jerk = limits->jerk_mm_s3;
    float room_mm = room * limits->junction_deviation_mm;
    for (unsigned ax = 0; ax < limits->axis_count; ax++) {
        most = max_f(most, limits->accel_mm_s2[ax]);
        sum += ax <= AXIS_Z ? limits->accel_mm_s2[ax] * limits->accel_mm_s2[ax] : 0.0f;
    }
    *across_mm_s2 = NO_LIMIT;
    if (jerk <= 0.0f)
        return 0.0f;
    float all = shaped ? sqrtf(sum) : TURNING * most,
          cube = 6.0f * room_mm / all * (jerk / most) * (jerk / most);
    if (room_mm > 0.0f && cube < 1.0f)
        part = cube_root(cube);
    part = min_f(part, 0.5f * longest_s * jerk / most);
    float mean_s = max_f(2.0f * part * most / jerk, MIN_MEAN_S);
    float square = mean_s * mean_s * (1.0f / 24.0f);
    if (room_mm > 0.0f && part * all * square > room_mm)
        part = room_mm / (all * square);
    *across_mm_s2 = room_mm > 0.0f && !shaped ? room_mm / (TURNING * square) : NO_LIMIT;
    for (unsigned ax = 0; ax < limits->axis_count; ax++)
        limits->accel_mm_s2[ax] *= part;
    return mean_s;
}

/* How far an axis comes off the path at most: half of the weights' second moment times the acceleration. */
static float off_mm(const struct shaper *shaper, const struct motion_limits *limits, unsigned ax) {
    return 0.5f * shaper_spread_s2(shaper, ax) * limits->accel_mm_s2[ax];
}

/* ... and X, Y and Z together. */
static float drift_mm(const struct shaper *shaper, const struct motion_limits *limits) {
    float sum = 0.0f;
    for (unsigned ax = 0; ax <= AXIS_Z && ax < limits->axis_count; ax++) {
        float off = off_mm(shaper, limits, ax);
        sum += off * off;
    }
    return sqrtf(sum);
}

/* At a place of rest that no stop is, the mean of the ways before and behind it may be farther from it than
 * there is room. Limited jerk alone brakes gently before it. */
static bool cuts(const struct plan *plan, bool shaped, float drift, float room_mm) {
    const struct motion_limits *limits = &plan->limits;
    if (!shaped)
        return shaper_is_on(&plan->shaper) && room_mm <= 0.0f;
    bool any = room_mm <= 0.0f || plan->path.mean_s > 0.0f || drift > room_mm;
    for (unsigned ax = AXIS_A; ax < limits->axis_count; ax++)
        any = any || off_mm(&plan->shaper, limits, ax) > room_mm;
    return any;
}

static bool is_shaped(const struct motion_limits *limits) {
    bool any = false;
    for (unsigned ax = 0; ax < limits->axis_count; ax++)
        any = any || limits->shaper[ax].kind != SHAPER_OFF;
    return any;
}

/* Limited jerk leaves `used` of the accelerations for bends. Far from them there is more, if it comes and
 * goes in steps (motion/ramp.h): all, or as much as may follow the part `part` of what is used. */
static void fit_ramps(struct plan *plan, float used, float part) {
    float far = used < 1.0f ? min_f(1.0f / used, part + JUMP) : 1.0f;
    float calm = max_f(far - JUMP, CALM * part), mean_s = (float)plan->shaper.mean_ns * 1e-9f;
    path_set_limits(&plan->path, &plan->limits, part, far);
    path_set_jerk(&plan->path, used < 1.0f ? mean_s : 0.0f, calm / far);
}

/* In bends and next to them the axes have the part of their acceleration with which the tolerance suffices.
 * On long straight ways they have all of it: what shaping does there is along the way. */
static void fit_shapers(struct plan *plan) {
    struct motion_limits *limits = &plan->limits, unshaped;
    float all_mm_s2 = limits->accel_mm_s2[AXIS_X], part = 1.0f, across_mm_s2;
    bool shaped = is_shaped(limits);
    shaper_set(&plan->shaper, limits, 0.0f, HISTORY_WINDOW);
    float longest_s = longest_mean_s(limits, (float)plan->shaper.window_ns * 1e-9f);
    float mean_s = fit_jerk(limits, shaped ? JERK_PART : SHAPE_PART, shaped, longest_s, &across_mm_s2);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        limits->max_rate_mm_s[ax] =
            min_f(limits->max_rate_mm_s[ax], MOTION_LONGEST_STOP_S * limits->accel_mm_s2[ax]);
    unshaped = *limits;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        unshaped.shaper[ax] = (struct shaper_mode){SHAPER_OFF, 0.0f, 0.0f};
    shaper_set(&plan->unshaped, &unshaped, mean_s, HISTORY_WINDOW);
    shaper_set(&plan->shaper, limits, mean_s, HISTORY_WINDOW);
    float room_mm = SHAPE_PART * limits->junction_deviation_mm, drift = drift_mm(&plan->shaper, limits);
    if (!shaped)
        drift = min_f(drift, room_mm);
    if (room_mm > 0.0f && drift > room_mm * (1.0f + ROUNDING))
        part = room_mm / drift;
    plan->shaped_mm = part * drift;
    fit_ramps(plan, limits->accel_mm_s2[AXIS_X] / all_mm_s2, part);
    float near_s = part < 1.0f ? shaper_reach_s(&plan->shaper) : 0.0f;
    plan->path.cuts = cuts(plan, shaped, drift, room_mm);
    plan->path.across_mm_s2 = across_mm_s2;
    plan->path.corner_s2 = across_mm_s2 < NO_LIMIT ? mean_s * mean_s * (1.0f / 48.0f) : 0.0f;
    float most_cut_mm = 2.0f * vec_length(plan->path.accel) * plan->path.corner_s2;
    plan->path.cut_sine = most_cut_mm > room_mm ? (1.0f - ROUNDING) * room_mm / most_cut_mm : 1.0f;
    path_set_shaper(&plan->path, &plan->shaper, max_f(near_s, plan->path.mean_s), room_mm);
}

/* The chord of a curve with the acceleration |A|, that of X, Y and Z together, is up to |A| T^2 / 8 off it.
 */
static float fit_curve(const struct motion_limits *limits) {
    float sum = 0.0f;
    for (unsigned ax = 0; ax <= AXIS_Z && ax < limits->axis_count; ax++)
        sum += limits->accel_mm_s2[ax] * limits->accel_mm_s2[ax];
    float time_s = sqrtf(8.0f * CURVE_PART * limits->junction_deviation_mm / sqrtf(sum));
    return min_f(CURVE_S, max_f(time_s, SHORT_CURVE_S));
}

/* Points are left out so that the look-ahead reaches far enough, and no farther: a report names the first
 * move of a chord, and a job is resumed there. With half of the pieces it reaches to where every axis can
 * stop. */
static float fit_merge(const struct motion_limits *limits, uint32_t look_ahead) {
    float way_mm = 0.0f;
    for (unsigned ax = 0; ax < limits->axis_count; ax++)
        way_mm = max_f(way_mm, limits->max_rate_mm_s[ax] * limits->max_rate_mm_s[ax] /
                                   (2.0f * limits->accel_mm_s2[ax]));
    return max_f(MIN_MERGE_MM, way_mm * (2.0f / (float)look_ahead));
}

void plan_set_limits(struct plan *plan, const struct motion_limits *limits) {
    plan->limits = *limits;
    fit_shapers(plan);
    plan->curve_s = fit_curve(&plan->limits);
    plan->merge_mm = fit_merge(&plan->limits, plan->look_ahead);
}
