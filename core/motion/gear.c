/* SPDX-License-Identifier: MIT */
#include "motion/gear.h"

#include "base/minmax.h"

#include <math.h>

#define GAIN_PER_S 125.0f /* near the line the error falls as e^(-t/8 ms) */
#define MEND_PART  0.5f   /* of the acceleration is for correcting a far error, the rest for the spindle's */
#define LOCKED_REV 0.005f /* nearer than this is on the line */
#define LOST_REV   0.1f   /* further than this is off it */
#define MIN_REV_S  0.05f
#define TO_THE_END 1.25f /* a stop that is at most this many samples away is reached in one */

void gear_begin(struct gear *gear, const struct gear_path *path) {
    *gear = (struct gear){.path = *path, .phase = GEAR_WAITS};
}

void gear_stop(struct gear *gear) {
    gear->must_stop = true;
    if (gear->phase == GEAR_WAITS)
        gear->phase = GEAR_DONE;
    else if (gear->phase == GEAR_RUNS)
        gear->phase = GEAR_STOPS;
}

void gear_brake(struct gear *gear) {
    if (gear->phase == GEAR_RUNS)
        gear->phase = GEAR_STOPS;
}

void gear_save(const struct gear *gear, struct gear_place *place) {
    place->phase = (uint8_t)gear->phase;
    if (gear->phase == GEAR_OFF)
        return;
    *place = (struct gear_place){.phase = (uint8_t)gear->phase,
                                 .at_mm = gear->at_mm,
                                 .zero_rev = gear->zero_rev,
                                 .v_mm_s = gear->v_mm_s,
                                 .locked = gear->locked,
                                 .ends = gear->ends,
                                 .lost = gear->lost,
                                 .run_ns = gear->run_ns};
}

void gear_load(struct gear *gear, const struct gear_place *place, bool stopped) {
    gear->phase = (enum gear_phase)place->phase;
    if (gear->phase == GEAR_OFF)
        return;
    bool at_end = !gear->path.reverses && place->at_mm >= (double)gear->path.way_mm;
    gear->at_mm = place->at_mm;
    gear->zero_rev = place->zero_rev;
    gear->v_mm_s = place->v_mm_s;
    gear->locked = place->locked;
    gear->ends = place->ends;
    gear->lost = place->lost;
    gear->run_ns = place->run_ns;
    if (stopped && (gear->phase == GEAR_STOPS || gear->phase == GEAR_DONE) && !at_end)
        gear->phase = GEAR_RUNS;
    if (gear->must_stop)
        gear_stop(gear);
}

void gear_clock(struct gear *gear, uint32_t now_us, bool standing, uint32_t started_us, uint32_t starts) {
    if (standing) {
        gear->clock_runs = false;
        gear->begin_us = now_us;
        gear->run_ns = 0;
        gear->starts = starts;
    } else if (!gear->clock_runs && starts != gear->starts) {
        gear->clock_runs = true;
        gear->begin_us = started_us;
    }
}

/* When what was put out so far has left the pins. */
static uint32_t end_us(const struct gear *gear) {
    return gear->begin_us + (uint32_t)(gear->run_ns / 1000u);
}

/* Speed of the line, mm/s; negative while it goes back. */
static float line_mm_s(const struct gear *gear, const struct spindle *spindle, uint32_t now_us) {
    return gear->path.pitch_mm * (float)gear->path.sense * spindle_rev_s(spindle, now_us);
}

static double line_rev(const struct gear *gear, const struct spindle *spindle, uint32_t at_us,
                       uint32_t now_us) {
    return (double)gear->path.sense * spindle_revs(spindle, at_us, now_us);
}

double gear_line_mm(const struct gear *gear, const struct spindle *spindle, uint32_t now_us) {
    return (double)gear->path.pitch_mm * (line_rev(gear, spindle, now_us, now_us) - gear->zero_rev);
}

/* Until the start: as long as the way to speed, v^2/2a, needs before the line comes to 0. */
static double wait(struct gear *gear, const struct spindle *spindle, float sample_s, bool whole,
                   uint32_t now_us) {
    const struct gear_path *path = &gear->path;
    float v = line_mm_s(gear, spindle, now_us);
    if (!gear->may_start || !gear->clock_runs || v < MIN_REV_S * path->pitch_mm)
        return (double)sample_s;
    uint32_t at_us = end_us(gear) + (uint32_t)(path->lag_s * 1e6f);
    double lead = (double)(v * v / (2.0f * path->accel_mm_s2));
    double due = line_rev(gear, spindle, at_us, now_us) + lead / (double)path->pitch_mm;
    double next = ceil(due), wait_s = (next - due) * (double)(path->pitch_mm / v);
    if (wait_s >= (double)sample_s)
        return (double)sample_s;
    gear->zero_rev = next;
    gear->phase = GEAR_RUNS;
    return whole ? (double)sample_s : wait_s;
}

/* How much faster than the line to go, with this error. */
static float mend_mm_s(float error_mm, float accel_mm_s2) {
    float accel = MEND_PART * accel_mm_s2, size = fabsf(error_mm);
    float near_mm = accel / (GAIN_PER_S * GAIN_PER_S);
    float v = size <= near_mm ? GAIN_PER_S * size : sqrtf(accel * (2.0f * size - near_mm));
    return error_mm < 0.0f ? -v : v;
}

/* Greatest speed at the end of a sample from which there still is a way to a stop within left_mm. */
static float stop_mm_s(float v, float left_mm, float accel, float sample_s) {
    float half = 0.5f * accel * sample_s;
    float square = half * half + 2.0f * accel * (left_mm - 0.5f * v * sample_s);
    return square > half * half ? sqrtf(square) - half : 0.0f;
}

/* Until it is on the line for the first time it is before it, because it started early. */
static void watch(struct gear *gear, float error_mm) {
    float rev = fabsf(error_mm) / gear->path.pitch_mm;
    gear->locked = gear->locked || rev < LOCKED_REV;
    if (rev > LOST_REV && (gear->locked || error_mm > 0.0f))
        gear->lost = true;
}

/* The speed that leads to the line. */
static float choose_mm_s(struct gear *gear, const struct spindle *spindle, float sample_s, uint32_t now_us) {
    const struct gear_path *path = &gear->path;
    uint32_t at_us = end_us(gear) + (uint32_t)(path->lag_s * 1e6f);
    double line_rev_now = line_rev(gear, spindle, at_us, now_us) - gear->zero_rev;
    float error_mm = (float)((double)path->pitch_mm * line_rev_now - gear->at_mm), v = gear->v_mm_s;
    float wanted = 0.0f, by = path->accel_mm_s2 * sample_s;
    if (gear->phase == GEAR_RUNS)
        wanted = line_mm_s(gear, spindle, now_us) + mend_mm_s(error_mm, path->accel_mm_s2);
    wanted = min_f(max_f(wanted, path->reverses ? -path->speed_mm_s : 0.0f), path->speed_mm_s);
    wanted = min_f(max_f(wanted, v - by), v + by);
    if (!path->reverses) {
        float left_mm = (float)((double)path->way_mm - gear->at_mm);
        float most = stop_mm_s(v, left_mm, path->accel_mm_s2, sample_s);
        gear->ends = gear->ends || most < wanted;
        wanted = min_f(wanted, most);
    }
    if (gear->phase == GEAR_RUNS && !gear->ends)
        watch(gear, error_mm);
    return wanted;
}

static double run(struct gear *gear, const struct spindle *spindle, float sample_s, bool whole,
                  uint32_t now_us) {
    const struct gear_path *path = &gear->path;
    float v = gear->v_mm_s, to = choose_mm_s(gear, spindle, sample_s, now_us);
    double left_mm = (double)path->way_mm - gear->at_mm;
    float last_s = whole ? sample_s : TO_THE_END * sample_s;
    if (!path->reverses && v > 0.0f && left_mm <= (double)(0.5f * v * last_s)) {
        gear->at_mm = (double)path->way_mm;
        gear->v_mm_s = 0.0f;
        gear->phase = GEAR_DONE;
        return whole ? (double)sample_s : 2.0 * left_mm / (double)v;
    }
    gear->at_mm += 0.5 * (double)(v + to) * (double)sample_s;
    gear->v_mm_s = to;
    if (gear->phase == GEAR_STOPS && to == 0.0f)
        gear->phase = GEAR_DONE;
    return (double)sample_s;
}

double gear_sample(struct gear *gear, const struct spindle *spindle, float sample_s, bool whole,
                   uint32_t now_us) {
    if (gear->phase == GEAR_WAITS)
        return wait(gear, spindle, sample_s, whole, now_us);
    return run(gear, spindle, sample_s, whole, now_us);
}

float gear_taper_mm(const struct gear_path *path) {
    float slope = min_f(path->slope, sqrtf(2.0f * path->bend_mm * path->depth_mm));
    return path->depth_mm / slope + 0.5f * slope / path->bend_mm;
}

/* Depth missing at a taper, this far from its outer end: straight at `slope` (or as steep as the bend allows
 * for so little depth), then a parabola into the full depth. */
static float missing_mm(const struct gear_path *path, float from_end_mm) {
    float steepest = sqrtf(2.0f * path->bend_mm * path->depth_mm);
    float slope = min_f(path->slope, steepest);
    float round_mm = slope / path->bend_mm; /* the parabola's length; its depth is half of slope * round_mm */
    float straight_mm = (path->depth_mm - 0.5f * slope * round_mm) / slope;
    if (from_end_mm <= straight_mm)
        return path->depth_mm - slope * from_end_mm;
    float left_mm = straight_mm + round_mm - from_end_mm;
    return left_mm > 0.0f ? 0.5f * path->bend_mm * left_mm * left_mm : 0.0f;
}

void gear_position(const struct gear *gear, double at_mm[AXIS_COUNT]) {
    const struct gear_path *path = &gear->path;
    double part = gear->at_mm / (double)path->way_mm, into = 1.0;
    if (path->depth_mm > 0.0f && path->entry)
        into -= (double)(missing_mm(path, (float)gear->at_mm) / path->depth_mm);
    if (path->depth_mm > 0.0f && path->exit)
        into -= (double)(missing_mm(path, (float)((double)path->way_mm - gear->at_mm)) / path->depth_mm);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        at_mm[ax] = path->from_mm[ax] + path->drive_mm[ax] * part + path->into_mm[ax] * into;
}
