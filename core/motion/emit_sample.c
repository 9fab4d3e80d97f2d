/* SPDX-License-Identifier: MIT */
#include "motion/emit_sample.h"

#include "motion/emit.h"
#include "motion/forward.h"

#include <math.h>

#define LONG_SAMPLE_S 0.004f  /* a segment of a straight part, or of a gentle bend */
#define SHORT_S       0.0002f /* less does not end where the acceleration changes */
#define FAR_PART      4u      /* of the pieces that a plan needs: with more of them no end is near */
#define STOP_FIRST    1.5f    /* usual samples: the first one of a stop without a shaper ... */
#define STOP_SAMPLES  96.0f   /* ... or a stop has so many of them */
#define STOP_SAMPLE_S 0.03f   /* they grow to this, or in a stop that takes long to a part of it: */
#define STOP_LONGEST  48.0f
#define STOP_DOUBLE   48u /* samples: after each so many they are twice as long */

/* A stop that only a late task needs is made for each batch, so it has few segments. Where it takes long to
 * slow down they grow all the same, because the stop must fit into a batch. */
static float stop_least_s(const struct emit *emit) {
    float least_s = emit->stop_first_s;
    for (uint32_t made = emit->stop_samples; made > STOP_DOUBLE; made -= STOP_DOUBLE)
        least_s *= 2.0f;
    return least_s;
}

float emit_stop_longer_s(const struct emit *emit, float time_s) {
    if (emit->stop != AHEAD_STOP || emit->v_mm_s <= 0.0f)
        return time_s;
    float longer_s = stop_least_s(emit) * sqrtf(emit->stop_v_mm_s / emit->v_mm_s);
    return max_f(time_s, min_f(longer_s, emit->stop_most_s));
}

/* In the blend at tail the acceleration across the path is at most a = |du| y / 2d (motion/timing.h). A chord
 * may be as far off it as one of least_s with all acceleration is. */
static float bend_sample_s(const struct emit *emit, float y, float least_s, float most_s) {
    struct path *path = &emit->plan->path;
    const struct piece *piece = path_piece(path, path->tail);
    float across = vec_length(path_piece(path, path->tail + 1)->unit - piece->unit) * y;
    float room = 2.0f * piece->tangent_mm * emit->plan->curve_mm_s2 * (least_s * least_s);
    if (room >= across * (most_s * most_s))
        return most_s;
    return max_f(least_s, sqrtf(room / across));
}

/* y on this half of the blend within that time: the plan's at its end, or as the axes can. */
static float highest_y(const struct emit *emit, float time_s) {
    struct path *path = &emit->plan->path;
    const struct piece *piece = path_piece(path, path->tail);
    float plan_y = emit->second_half ? path_piece(path, path->tail + 1)->enter_y : piece->middle_y;
    float more_mm_s = piece->accel_mm_s2 * time_s;
    return max_f(emit->y, min_f(plan_y, emit->y + more_mm_s * (2.0f * emit->v_mm_s + more_mm_s)));
}

/* A sender that is no faster than the machine has motion in small portions: what is committed cannot speed up
 * any more. Where moves come faster than they are travelled the end is near only when all have come. And a
 * segment has room for so many changes of a laser's S, or their mean. */
static bool takes_short(const struct emit *emit) {
    const struct plan *plan = emit->plan;
    if (emit->beam.on)
        return true;
    return emit->fed && !emit->flush && path_count(&plan->path) * FAR_PART < plan->timing.reach &&
           emit_nears_end(emit);
}

/* The straight part continues for longer than that. */
static bool is_straight_for(const struct emit *emit, const struct piece *piece, float time_s) {
    float more_mm_s = emit->stop == AHEAD_GO ? piece->accel_mm_s2 * time_s : 0.0f;
    float left_mm = piece->length_mm - piece->tangent_mm - emit->along_mm;
    return !emit->on_blend && left_mm > 1.5f * (emit->v_mm_s + more_mm_s) * time_s;
}

/* The longest segment from here on of what is committed, or of the end of what is planned. */
static float planned_s(const struct emit *emit, bool is_short) {
    const struct plan *plan = emit->plan;
    const struct piece *piece = path_piece(&emit->plan->path, plan->path.tail);
    float line_s = emit->stop == AHEAD_GO ? LONG_SAMPLE_S : emit->stop_most_s;
    if (is_short)
        return is_straight_for(emit, piece, line_s) ? line_s : plan->curve_s;
    if (!emit->on_blend)
        return line_s;
    return bend_sample_s(emit, highest_y(emit, 0.5f * LONG_SAMPLE_S), plan->curve_s, LONG_SAMPLE_S);
}

/* The same of a stop. */
static float stop_s(const struct emit *emit) {
    if (!emit->on_blend)
        return emit->stop_most_s;
    return bend_sample_s(emit, emit->y, stop_least_s(emit), emit->stop_most_s);
}

/* What a segment says of itself besides its motion must be the same all through it. */
static bool is_other(const struct piece *a, const struct piece *b) {
    return a->flags != b->flags || a->note != b->note;
}

/* Whoever travels on wants to know how fast. @return all is known; else one of several passes was made */
static bool need_timing(struct emit *emit) {
    if (emit->stop != AHEAD_GO || emit->hold || plan_is_timed(emit->plan, 0))
        return true;
    (void)plan_time(emit->plan, UINT32_MAX);
    return false;
}

float emit_travel_sample(struct emit *emit, const struct piece *piece) {
    const uint32_t *tail = &emit->plan->path.tail;
    bool stops = emit->stop == AHEAD_STOP, is_short = !stops && takes_short(emit);
    float most_s = stops ? stop_s(emit) : planned_s(emit, is_short), time_s = 0.0f;
    uint32_t timed_at = *tail;
    bool timed = false;
    while (time_s < most_s) {
        if (!timed || timed_at != *tail)
            timed = need_timing(emit);
        timed_at = *tail;
        float asked_s = most_s - time_s, took_s = travel(emit, asked_s);
        emit->work++;
        time_s += took_s;
        if (travel_ends(emit) || !emit->entered)
            break;
        if (time_s >= most_s || is_other(piece, travel_piece(emit)))
            break;
        if (!emit->on_blend && took_s < asked_s && !stops) { /* the acceleration changes */
            if (time_s > SHORT_S)
                break;
            most_s = emit->plan->curve_s;
        }
        if (!is_short)
            most_s = min_f(most_s, stops ? stop_s(emit) : planned_s(emit, is_short));
    }
    return time_s;
}

float emit_travel_time(struct emit *emit, float time_s) {
    const struct path *path = &emit->plan->path;
    float left_s = time_s;
    while (left_s > 0.0f && !travel_ends(emit)) {
        (void)need_timing(emit);
        left_s -= travel(emit, left_s);
        emit->work++;
        if (!emit->entered && (path->pieces[(path->tail - 1) & (PLAN_SIZE - 1)].flags & PIECE_STOP) != 0)
            break;
    }
    return time_s - left_s;
}

void emit_stop_begin(struct emit *emit) {
    struct plan *plan = emit->plan;
    float v_mm_s = max_f(emit->v_mm_s, 1e-3f), steps_per_mm = 1.0f,
          rest_s = (float)emit->shaper->window_ns * 1e-9f;
    for (unsigned ax = 0; ax < plan->limits.axis_count; ax++)
        steps_per_mm = max_f(steps_per_mm, plan->limits.steps_per_mm[ax]);
    if (path_count(&plan->path) > 0)
        rest_s += v_mm_s / (plan->path.near_part * path_piece(&plan->path, plan->path.tail)->accel_mm_s2);
    float most_s = 0.9f * (float)SEGMENT_MAX_STEPS / (v_mm_s * steps_per_mm);
    float usual_s = shaper_is_on(emit->shaper) ? emit->shaper->sample_s : STOP_FIRST * plan->curve_s;
    emit->stop_samples = 0;
    emit->stop_v_mm_s = emit->v_mm_s;
    emit->stop_first_s = min_f(max_f(usual_s, rest_s / STOP_SAMPLES), most_s);
    emit->stop_most_s = min_f(max_f(STOP_SAMPLE_S, rest_s / STOP_LONGEST), most_s);
}
