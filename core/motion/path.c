/* SPDX-License-Identifier: MIT */
#include "motion/path.h"

#include <string.h>

/* Grading: extra knots on a long chord, this many lengths of the short neighbour away from its ends. */
#define GRADE        1.5f
#define GRADE_MIN    3.0f /* a neighbour counts as at least this many tubes long */
#define GRADE_BOTH   0.6f /* of the chord: farther than this no knot of its own is made */
#define GRADE_SINGLE 0.67f
#define GRADE_MIDDLE 0.3f /* of the chord: two knots nearer than this are one in the middle */

/* Rounding a corner. */
#define FIRST          1.0f  /* of the way to the minimum at the first visit ... */
#define EAGER          1.4f  /* ... and at the next ones: the neighbours will come along */
#define TUBE_USED      0.97f /* of the tube, by relaxing */
#define SHIFT_MAX      0.45f /* of the shorter chord: two control points never pass each other */
#define SHARP          4.0f  /* tubes deep: such a corner is limited by its tube, however it is relaxed */
#define SHARE_MIN      0.02f /* of a chord, for the blend at each of its ends */
#define NEED           4.0f  /* a blend takes no more than this many times its lowest useful length */
#define NEED_MIN_MM    0.005f
#define MIN_TANGENT_MM 1e-6f
#define STRAIGHT       1e-5f   /* sine of half a turn that is only rounding */
#define FASTEST        2.0f    /* the largest override of the feed */
#define REVERSAL       0.9995f /* ... of a turn with no way round */
#define NO_TURN        1e-12f
#define NO_LIMIT_SQ    1e30f

void path_set_limits(struct path *path, const struct motion_limits *limits, float part, float far) {
    path->near_part = part / far;
    path->inverse_accel = path->inverse_far = path->inverse_rate = (vec){0};
    path->accel = (vec){0} + 1.0f; /* lanes without an axis limit nothing */
    for (unsigned ax = 0; ax < CORE_AXES; ax++) {
        path->accel[ax] = part * limits->accel_mm_s2[ax];
        path->inverse_accel[ax] = 1.0f / path->accel[ax];
        path->inverse_far[ax] = 1.0f / (far * limits->accel_mm_s2[ax]);
        path->inverse_rate[ax] = 1.0f / limits->max_rate_mm_s[ax];
    }
}

void path_set_shaper(struct path *path, const struct shaper *shaper, float near_s, float room_mm) {
    path->near_s = near_s;
    path->room_mm = room_mm;
    path->uneven = shaper->row_count > 1 && room_mm > 0.0f;
    path->spread = (vec){0};
    for (unsigned ax = 0; ax < CORE_AXES; ax++)
        path->spread[ax] = 0.5f * shaper_spread_s2(shaper, ax);
}

void path_set_jerk(struct path *path, float mean_s, float calm_part) {
    path->mean_s = mean_s;
    path->calm_part = calm_part;
}

void path_reset(struct path *path) {
    path->newest = path->placed = path->blended = 0;
    path->head = path->tail = path->kept = path->stop_head = path->stop_tail = path->stop_kept = 0;
    path->waits = path->may_go_on = path->reopened = false;
    path->before_mm = 0.0f;
    path_piece(path, path->head - 1)->tangent_mm = 0.0f; /* it begins at rest */
    path->lost = (vec){0};
    path->knots[0] = (struct knot){.stop = true};
}

/* ---- knots -> pieces: relax, place, blend ---- */

static struct knot *knot(struct path *path, uint32_t index) {
    return &path->knots[index & (KNOT_RING - 1)];
}

/* Would a blend as long as both chords allow be SHARP tubes deep? |turn| is twice the sine of half the angle.
 */
static bool is_sharp(const struct knot *k, float turn_sq, float shorter_mm) {
    float most = 8.0f * SHARP * k->info.tube_mm;
    return turn_sq * shorter_mm * shorter_mm > most * most;
}

/* The chord that ends at a knot, after one of its ends was moved by `by`. */
VEC_INLINE void move_chord(struct knot *k, vec by) {
    vec chord = k->unit * k->length_mm + by;
    k->length_mm = vec_length(chord);
    k->unit = chord * (1.0f / k->length_mm);
}

/* One visit to one control point, towards the least bending energy
 *
 *     E = sum of |T|^2 / l,   T = turn of the units at a knot, l = half of both its chords
 *
 * with the lengths of the chords held: E is quadratic in the point then, and its minimum one step away. The
 * point and the apex of the blend that it will get stay inside the tube.
 * @param part  of the way to the minimum */
static void relax(struct path *path, uint32_t index, float part) {
    struct knot *k = knot(path, index), *after = knot(path, index + 1);
    const struct knot *before = knot(path, index - 1);
    if (before->stop || k->stop || after->stop)
        return;
    const struct knot *next = knot(path, index + 2);
    float a = k->length_mm, b = after->length_mm, shorter_mm = min_f(a, b);
    vec turn = after->unit - k->unit;
    float tube_mm = k->info.tube_mm;
    if (is_sharp(k, vec_dot(turn, turn), shorter_mm) || tube_mm <= 0.0f)
        return;
    float inverse_a = 1.0f / a, inverse_b = 1.0f / b, bend = inverse_a + inverse_b;
    float l = 2.0f / (a + b); /* 1 / half of both chords */
    vec gradient = turn * (-bend * l);
    float hessian = bend * bend * l;
    vec turn_before = k->unit - before->unit;
    if (!is_sharp(before, vec_dot(turn_before, turn_before), min_f(before->length_mm, a))) {
        float l_before = 2.0f / (before->length_mm + a) * inverse_a;
        gradient += turn_before * l_before;
        hessian += l_before * inverse_a;
    }
    vec turn_after = next->unit - after->unit;
    if (!is_sharp(after, vec_dot(turn_after, turn_after), min_f(b, next->length_mm))) {
        float l_after = 2.0f / (b + next->length_mm) * inverse_b;
        gradient += turn_after * l_after;
        hessian += l_after * inverse_b;
    }
    vec along = k->unit + after->unit;
    float along_sq = vec_dot(along, along);
    vec step = gradient * (part / hessian);
    if (along_sq > 1e-6f)
        step -= along * (vec_dot(step, along) / along_sq);
    vec shift = k->shift - step;

    vec apex = shift + (turn + step * bend) * (0.125f * shorter_mm);
    float apex_sq = vec_dot(apex, apex), most_mm = TUBE_USED * tube_mm;
    if (apex_sq > most_mm * most_mm)
        shift -= apex * ((1.0f - most_mm / sqrtf(apex_sq)) / (1.0f - 0.125f * shorter_mm * bend));
    float shift_sq = vec_dot(shift, shift);
    most_mm = min_f(most_mm, SHIFT_MAX * shorter_mm);
    if (shift_sq > most_mm * most_mm)
        shift *= most_mm / sqrtf(shift_sq);
    vec by = shift - k->shift;
    k->shift = shift;
    move_chord(k, by);
    move_chord(after, -by);
}

/* Part of a chord for the blend at one of its ends, with these sines of half turns there and at the other
 * end: in proportion, so that both curves are equally sharp, or all that the other end's tube lets it leave.
 */
static float share(float sine, const struct knot *other, float other_sine, float length_mm) {
    if (other->stop)
        return 1.0f;
    float part = sine + other_sine > 0.0f ? sine / (sine + other_sine) : 0.5f;
    float taken = 4.0f * other->info.tube_mm;
    if (taken < (1.0f - part) * other_sine * length_mm)
        part = 1.0f - taken / (other_sine * length_mm);
    return part < SHARE_MIN ? SHARE_MIN : min_f(part, 1.0f - SHARE_MIN);
}

/* A slow corner is cut by the mean of limited jerk while the speed changes on both of its ways, more than by
 * the bend itself if they are diagonal. @return what that leaves of the tube: what is more than its room */
static float left_of_tube_mm(const struct path *path, const struct knot *k, const struct knot *after) {
    float accel_mm_s2 =
        vec_limit_along(k->unit, path->inverse_accel) + vec_limit_along(after->unit, path->inverse_accel);
    float cut_mm = k->sine * accel_mm_s2 * path->corner_s2 - path->room_mm;
    return cut_mm > 0.0f ? max_f(k->info.tube_mm - cut_mm, 0.0f) : k->info.tube_mm;
}

/* A corner that only its tube limits gains from a control point outside of it: the curve then has the tube on
 * both sides of the knot. */
static void push_out(struct path *path, uint32_t index) {
    struct knot *k = knot(path, index);
    const struct knot *before = knot(path, index - 1), *after = knot(path, index + 1);
    float sine_after = 0.0f;
    k->turn = after->unit - k->unit;
    k->sine = 0.5f * vec_length(k->turn);
    if (k->sine > path->cut_sine)
        k->info.tube_mm = left_of_tube_mm(path, k, after);
    float tube_mm = k->info.tube_mm;
    if (tube_mm <= 0.0f || k->sine < STRAIGHT || k->sine > REVERSAL)
        return;
    if (!after->stop)
        sine_after = 0.5f * vec_length(knot(path, index + 2)->unit - after->unit);
    float tangent_mm = min_f(k->length_mm * share(k->sine, before, before->sine, k->length_mm),
                             after->length_mm * share(k->sine, after, sine_after, after->length_mm));
    vec inside = k->turn * (0.5f / k->sine);
    float wanted_mm = 0.5f * tangent_mm * k->sine - tube_mm + vec_dot(k->shift, inside);
    if (wanted_mm <= 0.0f)
        return;
    k->shift -= inside * min_f(wanted_mm, 2.0f * tube_mm);
    float shift_mm = vec_length(k->shift);
    float most_mm = min_f(tube_mm, SHIFT_MAX * min_f(k->length_mm, after->length_mm));
    if (shift_mm > most_mm)
        k->shift *= most_mm / shift_mm;
}

/* How deep below its control point a blend may pass, so that its apex stays in the tube. */
static float depth_mm(const struct knot *k) {
    if (k->sine < STRAIGHT)
        return 1e30f;
    vec inside = k->turn * (0.5f / k->sine);
    float out_mm = -vec_dot(k->shift, inside);
    vec aside = k->shift + inside * out_mm;
    float left = k->info.tube_mm * k->info.tube_mm - vec_dot(aside, aside);
    return out_mm + (left > 0.0f ? sqrtf(left) : 0.0f);
}

/* a + b; what rounding takes of it is added to *rest (Knuth's sum of two). */
VEC_INLINE vec add_exactly(vec a, vec b, vec *rest) {
    vec sum = a + b, b_part = sum - a;
    *rest += (a - (sum - b_part)) + (b - b_part);
    return sum;
}

/* The control point gets its last place; with it the chord that ends here and the turn before are final. */
static void place(struct path *path, uint32_t index) {
    struct knot *before = knot(path, index - 1), *k = knot(path, index);
    if (!k->stop)
        push_out(path, index);
    vec rest = {0}, chord = add_exactly(k->chord, k->shift - before->shift, &rest);
    chord = add_exactly(chord, path->lost, &rest);
    k->length_mm = vec_length(chord);
    k->unit = chord * (1.0f / k->length_mm);
    path->lost = (chord - k->unit * k->length_mm) + rest;
    if (before->stop)
        return;
    before->turn = k->unit - before->unit;
    before->sine = 0.5f * vec_length(before->turn);
    before->depth_mm = depth_mm(before);
}

/* Length of both tangents of the blend at a knot; 0: passed at rest. */
static float tangent_mm(const struct path *path, const struct knot *before, const struct knot *k,
                        const struct knot *after, float limit_mm_s) {
    float left_mm = k->length_mm - before->tangent_mm;
    if (k->stop || k->sine > REVERSAL || left_mm <= 0.0f)
        return 0.0f;
    float most_mm = min_f(k->length_mm * share(k->sine, before, before->sine, k->length_mm), left_mm);
    most_mm = min_f(most_mm, after->length_mm * share(k->sine, after, after->sine, after->length_mm));
    if (k->sine < STRAIGHT)
        return min_f(most_mm, NEED_MIN_MM);
    most_mm = min_f(most_mm, 2.0f * k->depth_mm / k->sine);
    float speed_mm_s = min_f(max_f(k->info.asked_mm_s, after->info.asked_mm_s), limit_mm_s);
    float accel_mm_s2 = vec_limit_along(k->turn * (0.5f / k->sine), path->inverse_accel);
    accel_mm_s2 = min_f(accel_mm_s2, path->across_mm_s2);
    float need_mm = NEED * speed_mm_s * speed_mm_s * k->sine / accel_mm_s2;
    return min_f(most_mm, max_f(need_mm, NEED_MIN_MM));
}

/* Greatest acceleration along a straight way. Where the shapers of its axes differ, each of them is another
 * half second moment times its acceleration late, so that the way bends. */
static float far_mm_s2(const struct path *path, vec unit) {
    float accel_mm_s2 = vec_limit_along(unit, path->inverse_far);
    if (!path->uneven)
        return accel_mm_s2;
    vec late = unit * path->spread;
    float off_s2 = vec_length(late - unit * vec_dot(unit, late));
    return off_s2 * accel_mm_s2 > path->room_mm ? path->room_mm / off_s2 : accel_mm_s2;
}

/* Greatest y in a blend so that |du| y / 2 d, which is the acceleration across it in its middle, is not too
 * much. */
static float find_across_sq(const struct path *path, const struct knot *k) {
    float most = path->across_mm_s2 * k->tangent_mm;
    return most < k->sine * NO_LIMIT_SQ ? most / k->sine : NO_LIMIT_SQ;
}

/* The way in near_s from the blend at a knot, or towards it: at the greatest speed that its ends can have,
 * and as fast as it may change. With limited jerk a blend that hardly turns has one, too: at its ends other
 * accelerations are possible. */
static float near_mm(const struct path *path, const struct knot *k, const struct knot *after,
                     float across_sq) {
    bool ramps = path->mean_s > 0.0f;
    if (path->near_s <= 0.0f || (k->sine < STRAIGHT && !ramps))
        return 0.0f;
    float turn = max_f(vec_most(vec_abs(k->turn) * path->inverse_accel), NO_TURN);
    float asked_mm_s = FASTEST * max_f(k->info.asked_mm_s, after->info.asked_mm_s);
    float rate_mm_s =
        min_f(vec_limit_along(k->unit, path->inverse_rate), vec_limit_along(after->unit, path->inverse_rate));
    float accel_mm_s2 = max_f(vec_limit_along(k->unit, path->inverse_accel),
                              vec_limit_along(after->unit, path->inverse_accel));
    float bend_sq = 2.0f * k->tangent_mm / turn + (ramps ? 4.0f * accel_mm_s2 * k->tangent_mm : 0.0f);
    bend_sq = min_f(bend_sq, across_sq);
    float speed_mm_s = min_f(min_f(asked_mm_s, rate_mm_s), sqrtf(bend_sq));
    return (speed_mm_s + 0.5f * accel_mm_s2 * path->near_s) * path->near_s;
}

/* A stop is passed at speed after all, if the room for its blend is still there. @return false: it stays a
 * stop */
static bool blend_again(struct path *path, struct knot *k) {
    const struct knot *after = knot(path, path->blended + 1);
    path->reopened = false;
    /* Next to the new bend it brakes less hard than the slack is for. */
    float less_mm = near_mm(path, k, after, find_across_sq(path, k));
    k->tangent_mm = path_count(path) > 0 ? min_f(k->tangent_mm, path->slack_mm - less_mm) : 0.0f;
    k->stop = k->tangent_mm < MIN_TANGENT_MM;
    if (k->stop)
        return false;
    path->head--;
    path->stop_head--;
    path->changed = true;
    return true;
}

static void blend(struct path *path, uint32_t index) {
    struct knot *k = knot(path, index);
    const struct knot *after = knot(path, index + 1);
    float limit_mm_s = vec_limit_along(k->unit, path->inverse_rate);
    k->tangent_mm = tangent_mm(path, knot(path, index - 1), k, after, limit_mm_s);
    path->blended = index;
    if (path->reopened && !blend_again(path, k)) {
        k->tangent_mm = 0.0f;
        return;
    }
    if (k->tangent_mm < MIN_TANGENT_MM)
        k->tangent_mm = 0.0f;
    float bend_mm_s = vec_limit_along(k->unit + 0.5f * k->turn, path->inverse_rate);
    float accel_mm_s2 = far_mm_s2(path, k->unit);
    float stop_mm = 0.5f * path->near_part * accel_mm_s2 * path->mean_s * path->mean_s;
    float across_sq = find_across_sq(path, k);
    struct piece *piece = path_piece(path, path->head++);
    *piece = (struct piece){.unit = k->unit,
                            .length_mm = k->length_mm,
                            .tangent_mm = k->tangent_mm,
                            .asked_sq = k->info.asked_mm_s * k->info.asked_mm_s,
                            .limit_sq = limit_mm_s * limit_mm_s,
                            .bend_sq = min_f(bend_mm_s * bend_mm_s, across_sq),
                            .accel_mm_s2 = accel_mm_s2,
                            .near_mm = k->tangent_mm > 0.0f ? near_mm(path, k, after, across_sq) : stop_mm,
                            .line = k->info.line,
                            .note = k->info.note,
                            .units = k->info.units,
                            .flags = k->info.flags};
    if (k->stop)
        piece->flags |= PIECE_STOP;
    else if (k->tangent_mm == 0.0f && path->cuts)
        piece->flags |= PIECE_ARRIVE;
}

/* Append a knot at the end of this chord, and move the knots before it one stage on. */
static void add_knot(struct path *path, const vec *chord, float length_mm, const struct chord_info *info) {
    uint32_t n = ++path->newest;
    struct knot *k = knot(path, n), *before = knot(path, n - 1);
    *k = (struct knot){.chord = *chord, .length_mm = length_mm, .info = *info};
    k->unit = *chord * (1.0f / length_mm);
    if (info->tube_mm < before->info.tube_mm)
        before->info.tube_mm = info->tube_mm;
    float part = FIRST;
    for (uint32_t lag = 2; lag < 2 + PATH_VISITS && lag < n - path->placed; lag++) {
        relax(path, n - lag, part);
        part = EAGER;
    }
    if (n - path->placed > 3 + PATH_VISITS)
        place(path, ++path->placed);
    if (path->placed - path->blended > 2)
        blend(path, path->blended + 1);
}

/* The newest knot is a stop: all knots become pieces. */
static void stop_at_newest(struct path *path) {
    struct knot *last = knot(path, path->newest);
    last->stop = true;
    last->shift = last->turn = (vec){0};
    last->sine = last->tangent_mm = 0.0f;
    while (path->placed != path->newest)
        place(path, ++path->placed);
    while (path->blended != path->newest)
        blend(path, path->blended + 1);
}

/* ---- chords -> knots ---- */

static void push_part(struct path *path, const struct chord_wait *wait, const vec *chord, float part,
                      uint32_t units) {
    struct chord_info info = wait->info;
    info.units = units;
    add_knot(path, chord, part * wait->length_mm, &info);
}

/* A chord becomes one, two or three knots: where a long chord meets a short one,
 * a knot of its own lets it bend near its end. Lengths of the neighbours: 0 is a stop, where nothing bends.
 */
static void grade(struct path *path, const struct chord_wait *wait, float before_mm, float after_mm) {
    float length_mm = wait->length_mm, least_mm = GRADE_MIN * wait->info.tube_mm;
    bool has_before = before_mm > 0.0f, has_after = after_mm > 0.0f;
    float a = GRADE * max_f(before_mm, least_mm) / length_mm; /* parts of the chord */
    float b = GRADE * max_f(after_mm, least_mm) / length_mm;
    float first = 0.0f, second = 0.0f; /* parts from the start and from the end */
    if (has_before && has_after && a < GRADE_BOTH && b < GRADE_BOTH && a + b < 1.0f) {
        first = a;
        second = b;
        if (1.0f - a - b <= GRADE_MIDDLE) {
            first = 0.5f * (1.0f + a - b);
            second = 0.0f;
        }
    } else if (has_before && a < GRADE_SINGLE && (!has_after || a <= b)) {
        first = a;
    } else if (has_after && b < GRADE_SINGLE && (!has_before || b < a)) {
        second = b;
    }
    if (wait->info.tube_mm <= 0.0f)
        first = second = 0.0f;
    vec head = wait->chord * first, tail = wait->chord * second, middle = wait->chord - head - tail;
    vec end = second > 0.0f ? tail : wait->chord - head;
    uint32_t units = wait->info.units;
    uint32_t first_units = (uint32_t)(first * (float)units), last_units = (uint32_t)(second * (float)units);
    if (first > 0.0f)
        push_part(path, wait, &head, first, first_units);
    if (second > 0.0f)
        push_part(path, wait, &middle, 1.0f - first - second, units - first_units - last_units);
    push_part(path, wait, &end, second > 0.0f ? second : 1.0f - first,
              second > 0.0f ? last_units : units - first_units);
}

/* The chord that waits becomes knots; its successor's length is known, 0: it ends in a stop. */
static void take_waiting(struct path *path, float after_mm) {
    if (!path->waits)
        return;
    grade(path, &path->wait, path->before_mm, after_mm);
    path->before_mm = path->wait.length_mm;
    path->waits = false;
}

/* The stop at the end is none, if it has not been made: its knot waits again for its blend. */
static void reopen(struct path *path) {
    struct knot *last = &path->knots[path->newest & (KNOT_RING - 1)];
    bool may_go_on = path->may_go_on;
    path->may_go_on = false;
    if (!may_go_on || path_count(path) == 0)
        return;
    last->stop = false;
    path->reopened = true;
    path->blended--;
    path->before_mm = last->length_mm;
}

void path_chord(struct path *path, const vec *chord, float length_mm, const struct chord_info *info) {
    reopen(path);
    take_waiting(path, length_mm);
    path->wait = (struct chord_wait){*chord, length_mm, *info};
    path->waits = true;
}

void path_end(struct path *path, const int32_t stop_steps[AXIS_COUNT], bool may_go_on) {
    take_waiting(path, 0.0f);
    path->before_mm = 0.0f;
    if (path->knots[path->newest & (KNOT_RING - 1)].stop) {
        path->may_go_on = path->may_go_on && may_go_on;
        return;
    }
    stop_at_newest(path);
    memcpy(path->stop_steps[path->stop_head++ & (PATH_STOPS - 1)], stop_steps, sizeof path->stop_steps[0]);
    path->may_go_on = may_go_on;
}
