/* SPDX-License-Identifier: MIT */
#include "motion/forward.h"

#include <string.h>

#define ROUNDING 1e-6f /* relative: shorter parts of a profile are only rounding */
#define NOTHING                                                                                              \
    1e-7f /* of a direction's coefficient: only rounding; of none, so that nothing is divided by 0 */
#define WIDE       1e30f
#define SLACK      1.001f /* of the forward pass against the backward one, for rounding */
#define TO_THE_END 1.25f  /* a stop that is at most this many samples away is reached in one */
#define Y_ROUNDING 1e-5f  /* of y: so much of it may change beyond what the axes can do; 5e-6 of the speed */
#define A_ROUNDING 0.01f  /* of what the axes can do: so much more of it is only rounding */
#define ABOVE_PLAN 0.001f /* of the plan's y */
#define AT_PLAN_S                                                                                            \
    1e-4f /* a speed above the plan that the axes can take away in this time is only rounding                \
           */
#define ARRIVED_S2                                                                                           \
    5e-9f           /* a stop takes no more than 0.1 ms for this times its acceleration: as good as there */
#define CRAWL 0.75f /* of the y that is surely possible: a mean below it is too little */
#define WIDER 1.1f  /* limits that cannot be kept are widened in such steps until they can be */

static struct piece *tail_piece(const struct emit *emit) {
    return path_piece(&emit->plan->path, emit->plan->path.tail);
}

/* Place on the blend at tail, 0 .. 1. */
static float blend_t(const struct emit *emit) {
    return (emit->second_half ? 1.0f : 0.5f) - emit->left;
}

static void put_along(struct emit *emit, float along_mm) {
    emit->along_mm = along_mm;
    emit->along_rest_mm = 0.0f;
}

static void go_along(struct emit *emit, float by_mm) {
    float rest_mm = emit->along_rest_mm + by_mm, sum_mm = emit->along_mm + rest_mm;
    emit->along_rest_mm = rest_mm - (sum_mm - emit->along_mm);
    emit->along_mm = sum_mm;
}

static bool is_newest(const struct emit *emit) {
    return path_count(&emit->plan->path) == 1;
}

bool travel_rests(const struct emit *emit) {
    if (path_count(&emit->plan->path) == 0)
        return true;
    const struct piece *piece = tail_piece(emit);
    bool at_blend = emit->entered && emit->along_mm >= piece->length_mm - piece->tangent_mm;
    return emit->hold || (is_newest(emit) && at_blend && piece->tangent_mm > 0.0f);
}

/* At constant acceleration over `way` (mm of a line, or of 2 d dt of a blend, which follow the same law) to
 * y1, but no longer than time_s. @return part of the way done; *time_s becomes the time it took. */
static float run(struct emit *emit, float way, float y1, float *time_s) {
    float v0 = sqrtf(emit->y), v1 = sqrtf(y1);
    float most_s = y1 == 0.0f ? TO_THE_END * *time_s : *time_s;
    if (2.0f * way <= most_s * (v0 + v1)) {
        emit->y = y1;
        *time_s = 2.0f * way / (v0 + v1);
        return 1.0f;
    }
    float rate = *time_s / way; /* its time is 2 way / (v0 + v1) */
    float v = v0 + 0.5f * (v1 - v0) * (v0 + v1) * rate;
    emit->y = v * v;
    return 0.5f * (v0 + v) * rate;
}

#define FRACTION_BITS 23
#define EXPONENT_BIAS 127

/* a b in units of EMIT_CORNER, less than one of them short: one of the chips has no double precision. */
static int64_t product(float a, float b) {
    uint32_t x, y;
    memcpy(&x, &a, sizeof x);
    memcpy(&y, &b, sizeof y);
    const uint32_t one = 1u << FRACTION_BITS;
    int32_t exponent = (int32_t)(x >> FRACTION_BITS & 255u) + (int32_t)(y >> FRACTION_BITS & 255u);
    int32_t shift = exponent + EMIT_CORNER_BITS - 2 * (EXPONENT_BIAS + FRACTION_BITS);
    if (shift <= -2 * (FRACTION_BITS + 1)) /* nothing is left of it; 0, too */
        return 0;
    uint64_t whole = (uint64_t)((x & (one - 1u)) | one) * ((y & (one - 1u)) | one);
    whole = shift < 0 ? whole >> -shift : whole << shift;
    return ((x ^ y) >> 31) != 0 ? -(int64_t)whole : (int64_t)whole;
}

/* The piece at tail begins. Its chord is the very product that the path was made with. */
static void enter(struct emit *emit) {
    const struct piece *piece = tail_piece(emit);
    vec chord = piece->unit * piece->length_mm;
    for (unsigned ax = 0; ax < emit->plan->limits.axis_count; ax++)
        emit->corner[ax] += product(chord[ax], emit->plan->limits.steps_per_mm[ax]);
    emit->entered = true;
}

/* Braking from a high speed to a low one leaves few digits of y: a blend that asks for all of the
 * acceleration begins with the y that it was planned for. */
static void meet_plan(struct emit *emit, const struct piece *piece) {
    float most = sqrtf(piece->blend_y) + emit->plan->path.near_part * piece->accel_mm_s2 * AT_PLAN_S;
    if (!emit->late && emit->y > piece->blend_y && emit->y <= most * most)
        emit->y = piece->blend_y;
}

/* The end of the straight part: on to the blend, or to the next piece after a stop. */
static void end_line(struct emit *emit, const struct piece *piece) {
    struct path *path = &emit->plan->path;
    float rounding_y = 16.0f * ROUNDING * piece->accel_mm_s2 * piece->length_mm;
    if (!emit->late && emit->y > piece->blend_y * (1.0f + ABOVE_PLAN) + rounding_y)
        emit->plan->timing.unmet += emit->stop == AHEAD_GO; /* what is not executed is none */
    emit->ramp = 0.0f;
    if (piece->tangent_mm > 0.0f) {
        if (is_newest(emit)) {
            emit->y = 0.0f;
        } else {
            meet_plan(emit, piece);
            emit->on_blend = true;
            emit->second_half = false;
            emit->left = 0.5f;
        }
        return;
    }
    emit->y = 0.0f;
    emit->piece_at += piece->units;
    path->tail++;
    emit->entered = false;
    put_along(emit, 0.0f);
}

/* What is only rounding is 0. */
static float snap(float way_mm, float tiny_mm) {
    return fabsf(way_mm) <= tiny_mm ? 0.0f : way_mm;
}

/* What is left of the straight way, with limited jerk. */
static struct ramp_way find_way(const struct emit *emit, const struct piece *piece) {
    const struct path *path = &emit->plan->path;
    const struct piece *before = path_piece(&emit->plan->path, path->tail - 1);
    float at_mm = emit->along_mm,
          end_mm = (piece->length_mm - piece->tangent_mm - at_mm) - emit->along_rest_mm;
    float slow_mm = before->tangent_mm > 0.0f ? before->tangent_mm + before->near_mm : 0.0f;
    float tiny_mm = ROUNDING * piece->length_mm;
    return (struct ramp_way){.slow_mm = snap(slow_mm - at_mm, tiny_mm),
                             .brake_mm = snap(end_mm - piece->near_mm, tiny_mm),
                             .end_mm = end_mm,
                             .end_y = piece->blend_y,
                             .limit_y = timing_limit_sq(&emit->plan->timing, piece),
                             .accel = piece->accel_mm_s2,
                             .near = path->near_part * piece->accel_mm_s2,
                             .calm = path->calm_part * piece->accel_mm_s2,
                             .mean_s = path->mean_s};
}

/* Along the straight way for at most time_s, with limited jerk. */
static float travel_ramp(struct emit *emit, const struct ramp_way *way, float time_s) {
    bool late = emit->late;
    float v = sqrtf(emit->y), accel;
    time_s = ramp_time_s(way, emit->ramp, time_s);
    if (emit->hold)
        accel = ramp_stop(way, emit->ramp, v, time_s);
    else
        accel = ramp_choose(way, emit->ramp, v, time_s, &late);
    if (emit->y == 0.0f && accel <= 0.0f)
        accel = way->near;
    float way_mm = ramp_way_mm(way), y1 = emit->y + 2.0f * accel * way_mm;
    if (accel < -way->near && !emit->hold)
        y1 = max_f(SLACK * y1 - (SLACK - 1.0f) * emit->y, ramp_plan_y(way, way_mm));
    if (y1 < 0.0f) {
        way_mm = emit->y / (-2.0f * accel);
        y1 = 0.0f;
    }
    float part = run(emit, way_mm, y1, &time_s);
    emit->late = emit->late && late;
    emit->ramp = emit->y > 0.0f ? ramp_after(way, emit->ramp, accel, time_s) : 0.0f;
    go_along(emit, part * way_mm);
    return time_s;
}

/* A part of a straight way on which the acceleration is the same. */
struct stage {
    float end_mm; /* from the control point before */
    float accel_mm_s2;
    float exit_y; /* the plan's at its end */
    bool last;
};

static struct stage find_stage(const struct emit *emit, const struct piece *piece, float tiny_mm) {
    const struct piece *before = path_piece(&emit->plan->path, emit->plan->path.tail - 1);
    float begin_mm = before->tangent_mm, end_mm = piece->length_mm - piece->tangent_mm;
    float slow_mm = begin_mm + (before->tangent_mm > 0.0f ? before->near_mm : 0.0f);
    float brake_mm = end_mm - piece->near_mm;
    float along_mm = emit->along_mm + tiny_mm, near_mm_s2 = emit->plan->path.near_part * piece->accel_mm_s2;
    if (slow_mm < brake_mm && along_mm < brake_mm) {
        float brake_y = piece->blend_y + 2.0f * near_mm_s2 * (end_mm - brake_mm);
        if (along_mm >= slow_mm)
            return (struct stage){brake_mm, piece->accel_mm_s2, brake_y, brake_mm == end_mm};
        float slow_y = brake_y + 2.0f * piece->accel_mm_s2 * (brake_mm - slow_mm);
        return (struct stage){slow_mm, near_mm_s2, slow_y, false};
    }
    float accel_mm_s2 = brake_mm == end_mm && along_mm >= slow_mm ? piece->accel_mm_s2 : near_mm_s2;
    return (struct stage){end_mm, accel_mm_s2, piece->blend_y, true};
}

/* Braking for a late task takes no steps, but motion may continue in the middle of it, as fast as the plan
 * allows there: what it braked with counts, so that it may brake on with as much. */
static ramp_state ramp_of_stop(const struct emit *emit, const struct piece *piece, float accel_mm_s2,
                               float time_s) {
    if (emit->stop != AHEAD_STOP || emit->plan->path.mean_s <= 0.0f || emit->y <= 0.0f)
        return 0.0f;
    const struct ramp_way way = find_way(emit, piece);
    return ramp_after(&way, emit->ramp, -accel_mm_s2, time_s);
}

static float travel_line(struct emit *emit, float time_s) {
    const struct piece *piece = tail_piece(emit);
    float tiny_mm = ROUNDING * (piece->length_mm - piece->tangent_mm); /* less than that may change nothing */
    const struct stage stage = find_stage(emit, piece, tiny_mm);
    float end_mm = stage.end_mm, left_mm = (end_mm - emit->along_mm) - emit->along_rest_mm;
    float two_a = 2.0f * stage.accel_mm_s2, y = emit->y;
    float limit = timing_limit_sq(&emit->plan->timing, piece);
    float skip_mm = min_f(tiny_mm, ARRIVED_S2 * piece->accel_mm_s2); /* no step comes early by it */
    if (left_mm <= skip_mm) {
        put_along(emit, end_mm);
        end_line(emit, piece);
        return 0.0f;
    }
    if (emit->plan->path.mean_s > 0.0f && emit->stop != AHEAD_STOP) {
        const struct ramp_way way = find_way(emit, piece);
        if (ramp_is_needed(&way, emit->ramp))
            return travel_ramp(emit, &way, time_s);
    }
    float way_mm = left_mm, y1 = y - two_a * left_mm;
    if (emit->hold || y > limit * (1.0f + 100.0f * ROUNDING)) {
        float target = emit->hold ? 0.0f : limit;
        if (y1 < target) {
            way_mm = (y - target) / two_a;
            y1 = target;
        }
    } else {
        y1 = y - SLACK * two_a * left_mm;
        float exit = max_f(min_f(stage.exit_y, y + two_a * left_mm), y1);
        float peak = max_f(min_f(limit, 0.5f * (y + exit + two_a * left_mm)), y);
        float speed_up_mm = (peak - y) / two_a;
        if (speed_up_mm > tiny_mm) {
            way_mm = min_f(speed_up_mm, left_mm);
            y1 = peak;
        } else {
            float cruise_mm = left_mm - speed_up_mm - (peak - exit) / two_a;
            emit->y = peak;
            bool cruise = cruise_mm > tiny_mm;
            way_mm = cruise ? min_f(cruise_mm, left_mm) : left_mm;
            y1 = cruise ? peak : exit;
        }
        emit->late = emit->late && y1 > stage.exit_y;
    }
    bool to_end = way_mm >= left_mm - skip_mm;
    float part = run(emit, way_mm, y1, &time_s);
    if (to_end && part == 1.0f)
        put_along(emit, end_mm);
    else
        go_along(emit, part * way_mm);
    emit->ramp = ramp_of_stop(emit, piece, stage.accel_mm_s2, time_s);
    if (to_end && part == 1.0f && stage.last)
        end_line(emit, piece);
    return time_s;
}

/* A stretch of a blend, in the terms of motion/timing.h: from t, y over the next dt. */
struct stretch {
    vec u0, du;
    vec bound; /* 4 d A */
    float t, dt, y;
};

/* What the strip |a x + c| <= bound leaves of x, lane by lane. @param inverse  1 / |a| */
VEC_INLINE void strip(vec a, vec inverse, vec c, vec bound, vec *least, vec *greatest) {
    vec signed_c = vec_turn_sign(c, a);
    *greatest = (bound - signed_c) * inverse;
    *least = -(bound + signed_c) * inverse;
}

/* Does this slope dy/dt keep every axis within its acceleration on the stretch? Its ends say it. */
static bool allows(const struct stretch *stretch, float slope) {
    vec bend = stretch->du * (2.0f * stretch->y), bound = stretch->bound * SLACK;
    vec begin = bend + (stretch->u0 + stretch->du * stretch->t) * slope;
    vec end = bend + (stretch->u0 + stretch->du * (stretch->t + 3.0f * stretch->dt)) * slope;
    return vec_least(bound - vec_higher(vec_abs(begin), vec_abs(end))) >= 0.0f;
}

/* Least and greatest slope that do, with `room` times the axes' limits. @return there are such */
static bool find_slopes(const struct stretch *stretch, float room, float *least, float *greatest) {
    vec least_1, least_2, greatest_1, greatest_2;
    vec bend = stretch->du * (2.0f * stretch->y), bound = stretch->bound * room;
    vec begin = stretch->u0 + stretch->du * stretch->t;
    vec end = stretch->u0 + stretch->du * (stretch->t + 3.0f * stretch->dt);
    vec to_begin = vec_abs(begin) + NOTHING, to_end = vec_abs(end) + NOTHING;
    vec inverse = 1.0f / (to_begin * to_end); /* one division for both */
    strip(begin, inverse * to_end, bend, bound, &least_1, &greatest_1);
    strip(end, inverse * to_begin, bend, bound, &least_2, &greatest_2);
    *least = vec_most(vec_higher(least_1, least_2));
    *greatest = vec_least(vec_lower(greatest_1, greatest_2));
    return *least <= *greatest;
}

/* The slope that leads to end_y at the end of the stretch, or as near to it as the axes can: whatever the
 * plan says, their limits rule. The backward pass promises that a legal slope never ends above the plan, so
 * each time that one does, while no limit was lowered, is counted. */
static float choose_slope(struct emit *emit, const struct stretch *stretch, float end_y) {
    float least, greatest, slope = (end_y - emit->y) / stretch->dt;
    if (!emit->hold && allows(stretch, slope)) {
        emit->late = false;
        return slope;
    }
    bool possible = find_slopes(stretch, SLACK, &least, &greatest) ||
                    find_slopes(stretch, SLACK * SLACK, &least, &greatest); /* y may be at the edge of that */
    for (float room = SLACK * WIDER; least > greatest; room *= WIDER)
        (void)find_slopes(stretch, room, &least, &greatest);
    float above = least - slope;
    bool rounding =
        above * stretch->dt <= Y_ROUNDING * (emit->y + end_y) || above <= A_ROUNDING * (greatest - least);
    if (!possible || (above > 0.0f && !rounding && !emit->late))
        emit->plan->timing.unmet += emit->stop == AHEAD_GO; /* what is not executed is none */
    if (above <= 0.0f)
        emit->late = false;
    if (emit->hold)
        return least;
    if (above > 0.0f)
        return rounding && possible ? slope : least;
    return min_f(slope, greatest);
}

/* A y in the middle of the stretch from which 0 at its end can be reached surely, by the triangle inequality:
 * half of it or more is what the axes can do. */
static float lively_y(const struct emit *emit, const struct stretch *stretch, float d_mm) {
    vec u0 = vec_abs(stretch->u0), du = vec_abs(stretch->du);
    vec most = (2.0f * du + (u0 + 2.0f * du) * (2.0f / stretch->dt)) * emit->plan->path.inverse_accel;
    return 4.0f * d_mm / vec_most(most);
}

static void end_blend(struct emit *emit, const struct piece *piece) {
    put_along(emit, piece->tangent_mm);
    emit->on_blend = false;
    emit->piece_at += piece->units;
    emit->plan->path.tail++;
    enter(emit);
}

/* The plan's y at the end of this half of the blend at tail. */
static float plan_y(const struct emit *emit) {
    struct path *path = &emit->plan->path;
    return emit->second_half ? path_piece(path, path->tail + 1)->enter_y : tail_piece(emit)->middle_y;
}

/* The stretch of the blend at tail that is next: to its apex or its end. */
static struct stretch next_stretch(const struct emit *emit) {
    const struct path *path = &emit->plan->path;
    const struct piece *piece = tail_piece(emit);
    const struct piece *next = path_piece(&emit->plan->path, path->tail + 1);
    return (struct stretch){.u0 = piece->unit,
                            .du = next->unit - piece->unit,
                            .bound = path->accel * (4.0f * piece->tangent_mm),
                            .t = blend_t(emit),
                            .dt = emit->left,
                            .y = emit->y};
}

/* Every blend ends, whatever the plan says and whatever holds and overrides left of y, because none of it is
 * ever crawled along: where the straight way to end_y would stay below what is surely possible halfway, y
 * rises to that first, as steeply as it can. So dt of a half takes at most sqrt(dt) times a constant of the
 * blend, or its length at the feed. emit->left is a float by itself, so that dt and y fall to 0 in step,
 * and what is only rounding of t counts as done. */
static bool is_crawling(const struct emit *emit, const struct stretch *stretch, float end_y, float *lively) {
    struct plan *plan = emit->plan;
    const struct piece *piece = tail_piece(emit), *next = path_piece(&plan->path, plan->path.tail + 1);
    float most = 2.0f * piece->tangent_mm * stretch->dt * piece->accel_mm_s2; /* lively_y(), without a turn */
    if (emit->hold || emit->y >= CRAWL * most)
        return false;
    float limit = min_f(timing_limit_sq(&plan->timing, piece), timing_limit_sq(&plan->timing, next));
    limit = min_f(limit, piece->bend_sq);
    if (emit->y >= CRAWL * limit)
        return false;
    *lively = min_f(lively_y(emit, stretch, piece->tangent_mm), limit);
    float enough = CRAWL * *lively;
    return emit->y < enough && emit->y + end_y < 2.0f * enough;
}

/* The slope of this half that was found before, while nothing has changed.
 * @return whether there is one; then no part of the half is crawled along, because all of it is not */
static bool known_slope(const struct emit *emit, float end_y, float *slope) {
    const struct emit_slope *known = &emit->slope;
    uint32_t half = 2u * emit->plan->path.tail + emit->second_half;
    if (!known->known || known->half != half || known->plan == emit->hold)
        return false;
    if (known->plan && known->end_y != end_y)
        return false;
    *slope = known->plan ? (end_y - emit->y) / emit->left : known->value;
    return true;
}

/* A stop that is hardly ever made need not be the shortest. */
static void keep_slope(struct emit *emit, const struct stretch *stretch, float end_y, float slope) {
    bool plan = !emit->hold && slope == (end_y - emit->y) / stretch->dt;
    emit->slope = (struct emit_slope){.half = 2u * emit->plan->path.tail + emit->second_half,
                                      .known = plan || emit->stop == AHEAD_STOP,
                                      .plan = plan,
                                      .end_y = end_y,
                                      .value = slope};
}

/* The slope on this half, and for how much of it: *dt. @return it leads to a greater y first */
static bool find_slope(struct emit *emit, float end_y, float *slope, float *dt) {
    float lively = 0.0f;
    struct stretch stretch = next_stretch(emit);
    if (!is_crawling(emit, &stretch, end_y, &lively)) {
        *slope = choose_slope(emit, &stretch, end_y);
        keep_slope(emit, &stretch, end_y, *slope);
        return false;
    }
    stretch.dt *= 0.5f;
    *slope = choose_slope(emit, &stretch, WIDE);
    *dt = *slope > 0.0f ? min_f(stretch.dt, (lively - emit->y) / *slope) : stretch.dt;
    return true;
}

/* Along this half for at most *time_s, which becomes the time it took. @return whether it has ended */
static bool travel_half(struct emit *emit, const struct piece *piece, float *time_s) {
    float end_y = plan_y(emit), dt = emit->left, slope;
    bool speeds_up = !known_slope(emit, end_y, &slope) && find_slope(emit, end_y, &slope, &dt);
    float y1 = emit->y + slope * dt, all = dt;
    bool stops = y1 <= 0.0f && slope < 0.0f;
    if (stops) {
        dt = min_f(-emit->y / slope, dt);
        y1 = 0.0f;
    }
    float part = run(emit, 2.0f * piece->tangent_mm * dt, y1, time_s);
    emit->left -= part * dt;
    return part == 1.0f && !speeds_up && (!stops || dt >= all);
}

static float travel_blend(struct emit *emit, float time_s) {
    const struct piece *piece = tail_piece(emit);
    if (emit->left <= ROUNDING)
        time_s = 0.0f;
    else if (!travel_half(emit, piece, &time_s))
        return time_s;
    emit->left = 0.0f;
    if (emit->second_half) {
        end_blend(emit, piece);
    } else {
        emit->second_half = true;
        emit->left = 0.5f;
    }
    return time_s;
}

float travel(struct emit *emit, float time_s) {
    if (!emit->entered)
        enter(emit);
    return emit->on_blend ? travel_blend(emit, time_s) : travel_line(emit, time_s);
}

const struct piece *travel_piece(const struct emit *emit) {
    return path_piece(&emit->plan->path,
                      emit->plan->path.tail + (emit->on_blend && emit->second_half ? 1u : 0u));
}

/* Units of a length from the start of a piece. */
static uint32_t units_along(const struct piece *piece, float along_mm) {
    return (uint32_t)((float)piece->units * (along_mm / piece->length_mm));
}

uint32_t travel_power_place(const struct emit *emit) {
    const struct piece *piece = tail_piece(emit);
    float from_middle_mm = piece->tangent_mm * (2.0f * blend_t(emit) - 1.0f);
    if (!emit->entered)
        return emit->piece_at;
    if (!emit->on_blend)
        return emit->piece_at + units_along(piece, emit->along_mm);
    if (from_middle_mm < 0.0f)
        return emit->piece_at + units_along(piece, piece->length_mm + from_middle_mm);
    return emit->piece_at + piece->units +
           units_along(path_piece(&emit->plan->path, emit->plan->path.tail + 1), from_middle_mm);
}

float travel_position(const struct emit *emit, float from_corner_mm[AXIS_COUNT]) {
    const struct piece *piece = tail_piece(emit);
    vec at_mm = {0};
    float square = emit->y;
    if (emit->on_blend) {
        const vec u0 = piece->unit, du = path_piece(&emit->plan->path, emit->plan->path.tail + 1)->unit - u0;
        const float t = blend_t(emit);
        const vec along = u0 + du * t;
        at_mm = (u0 * (2.0f * t - 1.0f) + du * (t * t)) * piece->tangent_mm;
        square *= vec_dot(along, along);
    } else if (emit->entered) {
        at_mm = piece->unit * (emit->along_mm - piece->length_mm + emit->along_rest_mm);
    }
    vec_store(at_mm, from_corner_mm);
    return sqrtf(square);
}
