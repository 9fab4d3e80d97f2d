/* SPDX-License-Identifier: MIT */
#include "motion/emit_stop.h"

#include "motion/emit.h"

#include <math.h>

#define STOP_FIRST    1.5f  /* usual samples: the first one of a stop without a shaper ... */
#define STOP_SAMPLES  96.0f /* ... or a stop has so many of them */
#define STOP_SAMPLE_S 0.03f /* they grow to this, or in a stop that takes long to a part of it: */
#define STOP_LONGEST  48.0f
#define STOP_DOUBLE   48u  /* samples: after each so many they are twice as long */
#define STOP_FITS_S   3.0f /* a stop of this time has few enough samples, whatever they are */
#define STOP_LIMIT_S  1.5f /* of a sample: its nanoseconds and those of a shaper before it are a word */

/* A stop that only a late task needs is made for each batch, so it has few segments. Where it takes long to
 * slow down they grow all the same, because the stop must fit into a batch. */
static float stop_least_s(const struct emit *emit) {
    float least_s = emit->stop_first_s;
    for (uint32_t made = emit->stop_samples; made > STOP_DOUBLE; made -= STOP_DOUBLE)
        least_s *= 2.0f;
    return least_s;
}

float emit_stop_longer_s(const struct emit *emit, float v_mm_s, float time_s) {
    if (emit->stop != AHEAD_STOP)
        return time_s;
    /* The mean of a path that moves may rest. */
    float slower = v_mm_s > 0.0f ? max_f(emit->stop_v_mm_s / v_mm_s, 1.0f) : 1.0f;
    float longer_s = stop_least_s(emit) * sqrtf(slower);
    return max_f(time_s, min_f(longer_s, emit->stop_most_s));
}

/* a is at most |du| y / 2d (motion/timing.h). */
float emit_stop_sample_s(const struct emit *emit) {
    struct path *path = &emit->plan->path;
    const struct piece *piece = path_piece(path, path->tail);
    if (!emit->on_blend)
        return emit->stop_most_s;
    float across = vec_length(path_piece(path, path->tail + 1)->unit - piece->unit) * emit->y;
    float least_s = stop_least_s(emit);
    float room = 2.0f * piece->tangent_mm * piece->accel_mm_s2 * (least_s * least_s);
    if (room >= across * (emit->stop_most_s * emit->stop_most_s))
        return emit->stop_most_s;
    return room < across * (least_s * least_s) ? least_s : sqrtf(room / across);
}

/* At rest all spans were not enough for the stop. */
static void make_coarser(struct emit *emit, float most_s) {
    const float times = (float)(1u << emit->ahead->coarser);
    emit->stop_first_s = min_f(times * emit->stop_first_s, most_s);
    emit->stop_most_s = min_f(times * emit->stop_most_s, most_s);
}

void emit_stop_lengths(struct emit *emit, const struct shaper *shaper, float v_mm_s, float brakes_s) {
    const struct plan *plan = emit->plan;
    float steps_per_mm = 1.0f, stop_s = brakes_s + (float)shaper->window_ns * 1e-9f;
    for (unsigned ax = 0; ax < plan->limits.axis_count; ax++)
        steps_per_mm = max_f(steps_per_mm, plan->limits.steps_per_mm[ax]);
    float most_s = 0.9f * (float)SEGMENT_MAX_STEPS / (max_f(v_mm_s, 1e-3f) * steps_per_mm);
    float usual_s = shaper_is_on(shaper) ? shaper->sample_s : STOP_FIRST * plan->curve_s;
    emit->stop_samples = 0;
    emit->stop_v_mm_s = v_mm_s;
    emit->stop_first_s = min_f(max_f(usual_s, stop_s / STOP_SAMPLES), most_s);
    emit->stop_most_s = min_f(min_f(max_f(STOP_SAMPLE_S, stop_s / STOP_LONGEST), most_s), STOP_LIMIT_S);
    if (emit->ahead->coarser > 0)
        make_coarser(emit, min_f(most_s, STOP_LIMIT_S));
}

/* The least acceleration of the pieces that a stop from this speed comes to, and of that behind the blend. */
static float stop_accel_mm_s2(const struct emit *emit, float v_mm_s) {
    struct path *path = &emit->plan->path;
    float accel_mm_s2 = path_piece(path, path->tail)->accel_mm_s2, way_mm = -emit->along_mm;
    for (uint32_t i = path->tail; i != path->head; i++) {
        const struct piece *piece = path_piece(path, i);
        accel_mm_s2 = min_f(accel_mm_s2, piece->accel_mm_s2);
        way_mm += piece->length_mm;
        if (2.0f * path->near_part * accel_mm_s2 * (way_mm - piece->tangent_mm) > v_mm_s * v_mm_s)
            break;
    }
    return path->near_part * accel_mm_s2;
}

/* On a blend the square root of y falls by that acceleration; where the blend turns far it is much more than
 * the speed along the path. */
void emit_stop_begin(struct emit *emit) {
    const struct path *path = &emit->plan->path;
    float v_mm_s = max_f(emit->axes.v_mm_s, 1e-3f), falls_mm_s = max_f(v_mm_s, sqrtf(max_f(emit->y, 0.0f))),
          brakes_s = 0.0f;
    if (path_count(path) > 0) {
        const float slow_s = falls_mm_s / stop_accel_mm_s2(emit, falls_mm_s);
        brakes_s = falls_mm_s / (path->near_part * path_piece(&emit->plan->path, path->tail)->accel_mm_s2);
        brakes_s = slow_s > STOP_FITS_S ? slow_s : brakes_s;
    }
    emit_stop_lengths(emit, emit->axes.shaper, emit->axes.v_mm_s, brakes_s);
}
