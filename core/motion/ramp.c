/* SPDX-License-Identifier: MIT */
#include "motion/ramp.h"

#include "base/minmax.h"

#include <math.h>

#define ROUNDING 1e-5f  /* relative */
#define ALMOST   0.999f /* nearer than that is equal: of times and accelerations */
#define HALVINGS 6      /* of what an acceleration may be off the greatest */

/* Of speeding up at `accel`, >= 0. */
static float after_rise(const struct ramp_way *way, float state, float accel, float time_s) {
    float was_s = max_f(state, 0.0f), mean_s = way->mean_s;
    if (accel < ALMOST * way->calm)
        return 0.0f;
    if (accel > way->near * (2.0f - ALMOST))
        return 2.0f * mean_s;
    was_s = was_s > mean_s ? max_f(was_s - time_s, mean_s) : min_f(was_s + time_s, mean_s);
    return fabsf(was_s - mean_s) < (1.0f - ALMOST) * mean_s ? mean_s : was_s;
}

ramp_state ramp_after(const struct ramp_way *way, ramp_state state, float accel, float time_s) {
    return accel < 0.0f ? -after_rise(way, -state, -accel, time_s) : after_rise(way, state, accel, time_s);
}

float ramp_time_s(const struct ramp_way *way, ramp_state state, float time_s) {
    float left_s = state > 0.0f ? state - way->mean_s : fabsf(state + way->mean_s);
    return state != 0.0f && left_s > 0.0f ? min_f(time_s, left_s) : time_s;
}

float ramp_way_mm(const struct ramp_way *way) {
    if (way->slow_mm > 0.0f && way->slow_mm < way->brake_mm)
        return way->slow_mm;
    return way->brake_mm > 0.0f ? way->brake_mm : way->end_mm;
}

float ramp_plan_y(const struct ramp_way *way, float at_mm) {
    if (way->slow_mm >= way->brake_mm || at_mm >= way->brake_mm)
        return way->end_y + 2.0f * way->near * (way->end_mm - at_mm);
    float slow_mm = max_f(way->slow_mm - at_mm, 0.0f);
    return way->end_y + 2.0f * way->near * (way->end_mm - way->brake_mm + slow_mm) +
           2.0f * way->accel * (way->brake_mm - at_mm - slow_mm);
}

/* From speed v at this place, on without breaking a limit: while it must be calm it still speeds up; then it
 * brakes, for mean_s gently. Is it at the plan's y, or below, then? Until there the plan's y falls as fast or
 * faster, and from there on it is the plan. */
static bool is_safe(const struct ramp_way *way, ramp_state state, float v, float at_mm) {
    float rise_s = max_f(state - way->mean_s, 0.0f), v1 = v + way->calm * rise_s;
    if (v1 * v1 > max_f(way->limit_y, v * v) * (1.0f + ROUNDING))
        return false;
    at_mm += 0.5f * (v + v1) * rise_s;
    if (at_mm < way->brake_mm) {
        float fall_s = min_f(max_f(way->mean_s + min_f(state, 0.0f), 0.0f), v1 / way->near);
        float v2 = v1 - way->near * fall_s;
        at_mm += 0.5f * (v1 + v2) * fall_s;
        v1 = v2;
    }
    return v1 * v1 <= ramp_plan_y(way, at_mm) * (1.0f + ROUNDING);
}

static bool may(const struct ramp_way *way, ramp_state state, float v, float accel, float time_s) {
    float v1 = v + accel * time_s;
    if (v1 < 0.0f) {
        time_s = -v / accel;
        v1 = 0.0f;
    }
    return is_safe(way, ramp_after(way, state, accel, time_s), v1, 0.5f * (v + v1) * time_s);
}

/* `accel` may be used here, up or down. */
static bool is_far(const struct ramp_way *way) {
    return way->slow_mm <= 0.0f && way->brake_mm > 0.0f;
}

float ramp_stop(const struct ramp_way *way, ramp_state state, float v, float time_s) {
    bool hard = v - way->accel * time_s >= way->near * way->mean_s; /* the rest of v takes mean_s of `near` */
    if (is_far(way) && state <= -way->mean_s && (hard || !may(way, state, v, -way->near, time_s)))
        return -way->accel;
    return state > way->mean_s ? way->calm : -way->near;
}

float ramp_choose(const struct ramp_way *way, ramp_state state, float v, float time_s, bool *late) {
    float limit = sqrtf(way->limit_y);
    float greatest = state < -way->mean_s ? -way->calm : way->near;
    float least = state > way->mean_s ? way->calm : -way->near;
    float far_mm = (v + 0.5f * way->accel * time_s) * time_s;
    *late = false;
    if (is_far(way) && state >= way->mean_s && far_mm <= way->brake_mm &&
        may(way, state, v, way->accel, time_s))
        return way->accel;
    greatest = max_f(least, min_f(greatest, (limit - v) / time_s));
    if (may(way, state, v, greatest, time_s))
        return greatest;
    if (!may(way, state, v, least, time_s)) {
        bool hard = is_far(way) && state <= -way->mean_s;
        *late = !hard || v * v > ramp_plan_y(way, 0.0f) * (1.0f + ROUNDING); /* after a limit was lowered */
        return hard ? -way->accel : least;
    }
    for (int i = 0; i < HALVINGS; i++) {
        float middle = 0.5f * (least + greatest);
        bool good = may(way, state, v, middle, time_s);
        least = good ? middle : least;
        greatest = good ? greatest : middle;
    }
    return least;
}
