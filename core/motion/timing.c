/* SPDX-License-Identifier: MIT */
#include "motion/timing.h"

#define CUTS  8      /* most steps to the least value of a convex function */
#define CLOSE 0.001f /* relative: near enough */
#define NEVER (-1e30f)

/* Half a blend from ya to yb = (1 + rho) ya. The strips of timing.h at both of its ends then read
 *
 *     |2 du + q rho| ya <= 4 d A   for each axis,
 *
 * with one q for each end: 1/ya is at least the greatest of straight lines in rho, which is convex. Nothing
 * is divided by a direction, so a chord parallel to an axis is like any other. All is in units of 4 d A. */
struct half {
    vec bend;       /* 2 du */
    vec start, end; /* q */
};

/* The greatest of these lines at rho: a tangent, below the convex function everywhere. */
struct tangent {
    float rho, value, slope;
};

static float value_at(const struct tangent *tangent, float rho) {
    return tangent->value + tangent->slope * (rho - tangent->rho);
}

/* Where two lines are equally many, the one that rises more. */
static struct tangent tangent_at(const struct half *half, float rho) {
    vec at_start = half->bend + half->start * rho, at_end = half->bend + half->end * rho;
    float value = vec_most(vec_higher(vec_abs(at_start), vec_abs(at_end)));
    vec most = (vec){0} + value, none = (vec){0} + NEVER;
    vec start = vec_select(vec_is_less(vec_abs(at_start), most), none, vec_turn_sign(half->start, at_start));
    vec end = vec_select(vec_is_less(vec_abs(at_end), most), none, vec_turn_sign(half->end, at_end));
    return (struct tangent){rho, value, vec_most(vec_higher(start, end))};
}

/* Greatest ya <= cap from which some yb in 0 .. most can be reached. That yb <= most is one more straight
 * line, (1 + rho) / most. Between a falling and a rising tangent the least value of the function is where
 * they meet, or above; so look there next. Every value that is returned was looked at, hence is possible,
 * however early the search ends. *settled: a greater `most` changes nothing. */
static float greatest_start(const struct half *half, float most, float cap, bool *settled) {
    float least = 1.0f / cap, from = most < cap ? most / cap - 1.0f : 0.0f;
    struct tangent first = tangent_at(half, from);
    *settled = first.value <= least || first.slope >= 0.0f;
    if (first.value <= least)
        return cap;
    if (most <= 0.0f)
        return 1.0f / first.value;
    struct tangent fall = first, rise = {-1.0f, 0.0f, 1.0f / most};
    float best = first.value;
    if (*settled) {
        rise = first;
        fall = tangent_at(half, -1.0f);
        best = min_f(best, fall.value);
    }
    for (int i = 0; i < CUTS && fall.slope < 0.0f; i++) {
        float rho = fall.rho + (fall.value - value_at(&rise, fall.rho)) / (rise.slope - fall.slope);
        float bound = value_at(&rise, rho);
        if (best <= max_f(bound, least) * (1.0f + CLOSE))
            break;
        struct tangent next = tangent_at(half, rho);
        best = min_f(best, max_f(next.value, bound));
        if (next.slope < 0.0f) {
            fall = next;
        } else {
            rise = next;
            *settled = true;
        }
    }
    return 1.0f / max_f(best, least);
}

/* With limited jerk gentle braking lasts for a mean_s next to a bend, so that way must take that long: at no
 * more than this v^2 at its start; at its end: at no more than that. */
static float gentle_start_sq(const struct path *path, const struct piece *piece, const struct piece *before) {
    float by_mm_s = path->near_part * piece->accel_mm_s2 * path->mean_s;
    float v_mm_s = before->near_mm / path->mean_s + 0.5f * by_mm_s;
    return v_mm_s * v_mm_s;
}

static float gentle_end_sq(const struct path *path, const struct piece *piece) {
    float by_mm_s = path->near_part * piece->accel_mm_s2 * path->mean_s;
    float v_mm_s = piece->near_mm / path->mean_s - 0.5f * by_mm_s;
    return v_mm_s * v_mm_s;
}

/* Both halves of the blend between a piece and its successor. What was found before was possible with a
 * slower successor, so it still is: nothing is ever lowered, however the search of the new values ended.
 * @return whether a faster successor would change nothing at its start */
static bool find_blend(const struct path *path, struct piece *piece, const struct piece *next, float cap,
                       float next_cap) {
    vec inverse = path->inverse_accel * (0.25f / piece->tangent_mm);
    vec u0 = 2.0f * piece->unit * inverse, du = (next->unit - piece->unit) * inverse;
    struct half half = {.bend = 2.0f * du, .start = u0 + du, .end = u0 + 4.0f * du};
    bool first_settled, second_settled;
    float middle_cap = min_f(min_f(cap, next_cap), piece->bend_sq);
    float middle_y = greatest_start(&half, next->enter_y, middle_cap, &second_settled);
    piece->middle_y = max_f(piece->middle_y, middle_y);
    half.start = u0;
    half.end = u0 + 3.0f * du;
    cap = min_f(cap, piece->bend_sq);
    if (path->mean_s > 0.0f)
        cap = min_f(cap, gentle_end_sq(path, piece));
    float blend_y = greatest_start(&half, piece->middle_y, cap, &first_settled);
    piece->blend_y = max_f(piece->blend_y, blend_y);
    return first_settled || second_settled;
}

static void begin(struct timing *timing, const struct path *path) {
    uint32_t head = timing_next_head(timing);
    if (timing->whole || (int32_t)(path->head - head) < 0)
        head = path->head;
    if (timing->whole)
        timing->settled = path->tail;
    timing->pass = (struct timing_pass){
        .runs = true, .whole = timing->whole, .head = head, .at = head, .settled = timing->settled};
    timing->whole = false;
}

/* What later regular passes leave alone is settled, too. */
static void end(struct timing *timing) {
    timing->pass.runs = false;
    timing->known = timing->pass.head;
    uint32_t left_alone = timing_next_head(timing) - timing->reach;
    bool farther = (int32_t)(left_alone - timing->pass.settled) > 0;
    timing->settled = farther ? left_alone : timing->pass.settled;
}

/* One piece. @return whether those before it stay as they are */
static bool look(struct timing *timing, struct path *path) {
    struct timing_pass *pass = &timing->pass;
    uint32_t i = --pass->at;
    struct piece *piece = path_piece(path, i);
    const struct piece *before = path_piece(path, i - 1), *next = path_piece(path, i + 1);
    float cap = timing_limit_sq(timing, piece);
    bool newest = i + 1 == pass->head, settled = piece->tangent_mm == 0.0f;
    if (pass->whole)
        piece->middle_y = piece->blend_y = 0.0f;
    if (!newest && piece->tangent_mm > 0.0f)
        settled = find_blend(path, piece, next, cap, pass->next_cap);
    float line_mm = max_f(piece->length_mm - piece->tangent_mm - before->tangent_mm, 0.0f);
    float near_mm = piece_near_mm(piece, before, line_mm);
    float enter_y =
        piece->blend_y + 2.0f * piece->accel_mm_s2 * (path->near_part * near_mm + line_mm - near_mm);
    float enter_cap = before->tangent_mm > 0.0f ? min_f(cap, before->bend_sq) : cap;
    if (path->mean_s > 0.0f && before->tangent_mm > 0.0f && near_mm < line_mm)
        enter_cap = min_f(enter_cap, gentle_start_sq(path, piece, before));
    if (!pass->found && (settled || enter_y >= enter_cap)) {
        pass->found = true;
        pass->settled = i;
    }
    enter_y = min_f(enter_y, enter_cap);
    if (!pass->whole && (int32_t)(i - timing->settled) <= 0)
        return true;
    bool seen = !pass->whole && (int32_t)(timing->known - i) > 1;
    if (seen && enter_y <= piece->enter_y * (1.0f + CLOSE))
        return true;
    piece->enter_y = enter_y;
    pass->next_cap = cap;
    return false;
}

bool timing_backward(struct timing *timing, struct path *path, uint32_t most) {
    const struct timing_pass *pass = &timing->pass;
    if (!pass->runs || timing->whole)
        begin(timing, path);
    for (; (int32_t)(pass->at - path->kept) > 0; most--) {
        if (most == 0)
            return false;
        if (look(timing, path))
            break;
    }
    end(timing);
    return true;
}
