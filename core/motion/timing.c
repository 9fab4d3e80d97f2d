/* SPDX-License-Identifier: MIT */
#include "motion/timing.h"

#define NOTHING 1e-6f /* a direction's coefficient that is only rounding */
#define WIDE    1e30f
#define CUTS    8      /* most steps to the best of a concave function */
#define CLOSE   0.001f /* relative: near enough */

/* Half a blend from ya to yb, with s = 2 (yb - ya) in the strips of timing.h at both its ends: each axis
 * wants
 *
 *     |a ya + b yb| <= bound,   so   ya is within   -+ most - slope yb,   most = bound / |a|, slope = b / a.
 */
struct half {
    vec start_most, start_slope, end_most, end_slope;
};

/* One strip as bounds of ya. */
VEC_INLINE void strip_bounds(vec a, vec b, vec bound, vec *most, vec *slope) {
    vec inverse = 1.0f / vec_select(vec_abs(a) < NOTHING, vec_turn_sign((vec){0} + NOTHING, a), a);
    *most = bound * vec_abs(inverse);
    *slope = b * inverse;
}

/* What a half leaves of ya, given yb. */
struct reach {
    float least, greatest;
};

static struct reach reach_of(const struct half *half, float yb) {
    vec start = half->start_slope * yb, end = half->end_slope * yb;
    return (struct reach){
        .least = -vec_least(vec_lower(half->start_most + start, half->end_most + end)),
        .greatest = vec_least(vec_lower(half->start_most - start, half->end_most - end)),
    };
}

/* How its greatest and its least change with yb. */
static float top_slope(const struct half *half, float yb, float greatest) {
    vec none = (vec){0} + WIDE;
    vec_mask start = half->start_most - half->start_slope * yb <= greatest;
    vec_mask end = half->end_most - half->end_slope * yb <= greatest;
    return -vec_least(
        vec_lower(vec_select(start, half->start_slope, none), vec_select(end, half->end_slope, none)));
}
static float bottom_slope(const struct half *half, float yb, float least) {
    vec none = (vec){0} - WIDE;
    vec_mask start = half->start_most + half->start_slope * yb <= -least;
    vec_mask end = half->end_most + half->end_slope * yb <= -least;
    return -vec_most(
        vec_higher(vec_select(start, half->start_slope, none), vec_select(end, half->end_slope, none)));
}

/* Greatest yb <= most for which any ya is possible. Between its ends the reach is concave: Newton's steps
 * come from above, and as it is made of straight parts, they arrive. yb = 0 is always possible. */
static struct reach last_possible(const struct half *half, float *most) {
    struct reach reach = reach_of(half, *most);
    for (int i = 0; i < CUTS && reach.least - reach.greatest > CLOSE * fabsf(reach.greatest); i++) {
        *most += (reach.least - reach.greatest) /
                 (top_slope(half, *most, reach.greatest) - bottom_slope(half, *most, reach.least));
        *most = i + 1 < CUTS && *most > 0.0f ? *most : 0.0f;
        reach = reach_of(half, *most);
    }
    return reach;
}

/* The top of the concave upper end of the reach, which falls at `to`: where the tangents at both ends of a
 * bracket meet it can at most be, so look there next. */
static float top_of(const struct half *half, float to, float to_top, float to_slope) {
    float from = 0.0f, from_top = reach_of(half, 0.0f).greatest, from_slope = top_slope(half, 0.0f, from_top);
    float best = most_f(from_top, to_top);
    for (int i = 0; i < CUTS && from_slope > 0.0f; i++) {
        float step = (to_top - from_top - to_slope * (to - from)) / (from_slope - to_slope);
        float middle = from + step;
        if (from_top + from_slope * step <= best * (1.0f + CLOSE) || middle <= from || middle >= to)
            break;
        float top = reach_of(half, middle).greatest, slope = top_slope(half, middle, top);
        best = most_f(best, top);
        if (slope >= 0.0f) {
            from = middle;
            from_top = top;
            from_slope = slope;
        } else {
            to = middle;
            to_top = top;
            to_slope = slope;
        }
    }
    return best;
}

/* Greatest ya <= cap for which some yb in 0 .. most is possible. *settled: a greater `most` changes nothing.
 */
static float greatest_start(const struct half *half, float most, float cap, bool *settled) {
    float possible = most;
    struct reach reach = last_possible(half, &possible);
    *settled = true;
    if (reach.greatest >= cap)
        return cap;
    float slope = top_slope(half, possible, reach.greatest);
    if (slope < 0.0f)
        return least_f(top_of(half, possible, reach.greatest, slope), cap);
    *settled = possible < most;
    return reach.greatest;
}

/* Both halves of the blend between a piece and its successor. @return whether a faster successor would change
 * nothing at its start */
static bool find_blend(const struct path *path, struct piece *piece, const struct piece *next, float cap,
                       float next_cap) {
    vec u0 = piece->unit, du = next->unit - u0, bound = path->accel * (4.0f * piece->tangent_mm);
    struct half half;
    strip_bounds(du - 2.0f * u0, 2.0f * u0 + du, bound, &half.start_most, &half.start_slope);
    strip_bounds(-2.0f * (u0 + du), 2.0f * u0 + 4.0f * du, bound, &half.end_most, &half.end_slope);
    bool first_settled, second_settled;
    piece->middle_y = greatest_start(&half, next->enter_y, least_f(cap, next_cap), &second_settled);
    strip_bounds(2.0f * (du - u0), 2.0f * u0, bound, &half.start_most, &half.start_slope);
    strip_bounds(-(2.0f * u0 + du), 2.0f * u0 + 3.0f * du, bound, &half.end_most, &half.end_slope);
    piece->blend_y = greatest_start(&half, piece->middle_y, cap, &first_settled);
    return first_settled || second_settled;
}

void timing_backward(struct timing *timing, struct path *path) {
    float next_cap = 0.0f;
    bool found = false;
    if (timing->whole)
        timing->settled = path->tail;
    for (uint32_t i = path->head; i != path->tail;) {
        struct piece *piece = path_piece(path, --i);
        const struct piece *next = path_piece(path, i + 1);
        float cap = timing_limit_sq(timing, piece);
        bool newest = i + 1 == path->head, settled = piece->tangent_mm == 0.0f;
        if (newest || piece->tangent_mm == 0.0f)
            piece->middle_y = piece->blend_y = 0.0f;
        else
            settled = find_blend(path, piece, next, cap, next_cap);
        float before_mm = i != path->tail ? path_piece(path, i - 1)->tangent_mm : 0.0f;
        float line_mm = piece->length_mm - piece->tangent_mm - before_mm;
        float enter_y = piece->blend_y + 2.0f * piece->accel_mm_s2 * most_f(line_mm, 0.0f);
        if (!found && (settled || enter_y >= cap)) {
            found = true;
            timing->settled = i;
        }
        enter_y = least_f(enter_y, cap);
        bool seen = !timing->whole && timing->known - i - 1 < path_count(path) && i + 1 != timing->known;
        if (seen && enter_y <= piece->enter_y * (1.0f + CLOSE))
            break;
        piece->enter_y = enter_y;
        next_cap = cap;
    }
    timing->known = path->head;
    timing->whole = false;
}
