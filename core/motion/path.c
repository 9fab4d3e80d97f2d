/* SPDX-License-Identifier: MIT */
#include "motion/path.h"

#include "motion/smooth.h"

#include <string.h>

/* Grading: extra knots on a long chord, this many lengths of the short neighbour away from its ends. */
#define GRADE        1.5f
#define GRADE_LEAST  3.0f /* a neighbour counts as at least this many tubes long */
#define GRADE_BOTH   0.6f /* of the chord: farther than this no knot of its own is made */
#define GRADE_SINGLE 0.67f
#define GRADE_MIDDLE 0.3f /* of the chord: two knots nearer than this are one in the middle */

void path_set_limits(struct path *path, const struct motion_limits *limits) {
    path->axis_count = limits->axis_count;
    path->accel = path->inverse_accel = path->inverse_rate = (vec){0};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        path->accel[ax] = limits->accel_mm_s2[ax];
        path->inverse_accel[ax] = 1.0f / limits->accel_mm_s2[ax];
        path->inverse_rate[ax] = 1.0f / limits->max_rate_mm_s[ax];
    }
}

void path_reset(struct path *path) {
    path->newest = path->placed = path->blended = 0;
    path->head = path->tail = path->kept = path->stop_head = path->stop_tail = path->stop_kept = 0;
    path->waits = path->may_go_on = path->reopened = false;
    path->before_mm = 0.0f;
    path_piece(path, path->head - 1)->tangent_mm = 0.0f; /* it begins at rest */
    memset(path->lost_mm, 0, sizeof path->lost_mm);
    path->knots[0] = (struct knot){.stop = true};
}

static void push_part(struct path *path, const struct chord_wait *wait, const vec *chord, float part) {
    smooth_knot(path, chord, part * wait->length_mm, &wait->info);
}

/* A chord becomes one, two or three knots: where a long chord meets a short one,
 * a knot of its own lets it bend near its end. Lengths of the neighbours: 0 is a stop, where nothing bends.
 */
static void grade(struct path *path, const struct chord_wait *wait, float before_mm, float after_mm) {
    float length_mm = wait->length_mm, least_mm = GRADE_LEAST * wait->info.tube_mm;
    bool has_before = before_mm > 0.0f, has_after = after_mm > 0.0f;
    float a = GRADE * most_f(before_mm, least_mm) / length_mm; /* parts of the chord */
    float b = GRADE * most_f(after_mm, least_mm) / length_mm;
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
    if (first > 0.0f)
        push_part(path, wait, &head, first);
    if (second > 0.0f)
        push_part(path, wait, &middle, 1.0f - first - second);
    push_part(path, wait, &end, second > 0.0f ? second : 1.0f - first);
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
    smooth_end(path);
    memcpy(path->stop_steps[path->stop_head++ & (PATH_STOPS - 1)], stop_steps, sizeof path->stop_steps[0]);
    path->may_go_on = may_go_on;
}
