/* SPDX-License-Identifier: MIT */
#include "motion/motion.h"

#include "base/debug.h"
#include "motion/fit.h"
#include "motion/joints.h"
#include "motion/kinematics/kinematics.h"

#include <string.h>

#define ROUNDING_MM   0.003f  /* twice that of a file with 4 decimals of an inch */
#define REDUCE_MAX    0.6f    /* of the tolerance, to come up to that */
#define REDUCE_PART   0.3f    /* of the tolerance is for leaving out points, the rest for rounding corners */
#define MIN_TOLERANCE 0.5f    /* of the tolerance is left, however much of it an arc's chords take */
#define MIN_CHORD_MM  2e-5f   /* a shorter one has no direction in float32 */
#define RAPID_MM_S    1e15f   /* its square still is a float */
#define LONGEST_MM    4096.0f /* of a chord: places along it are single floats, there exact to 0.25 um */
#define ALL_OF_IT     1e30f
#define SELDOM        __attribute__((noinline)) /* apart from what most polls take */

/* ---- straight moves -> chords (motion/planner.h) ---- */

/* Empty and at rest at this position. */
static void plan_reset(struct plan *plan, const int32_t position_steps[AXIS_COUNT]) {
    kinematics_position_mm(position_steps, plan->limits.steps_per_mm, plan->position_mm);
    reduce_reset(&plan->reduce, plan->position_mm);
    path_reset(&plan->path);
    power_reset(&plan->power);
    plan->timing.known = plan->timing.settled = 0;
    plan->timing.whole = plan->timing.pass.runs = false;
}

/* How far a point that is left out may lie from the chord: points are rounded when they are written, and what
 * is less than that rounding would make every chord end at another error of it. */
static float reduce_mm(float tolerance_mm) {
    return max_f(REDUCE_PART * tolerance_mm, min_f(REDUCE_MAX * tolerance_mm, ROUNDING_MM));
}

/* Speed along a chord. The feed counts along X Y Z; the other axes keep up (RS274/NGC 2.1.2.5). */
static float asked_mm_s(const struct motion_line *line, const vec *chord, float length_mm) {
    float x_mm = (*chord)[AXIS_X], y_mm = (*chord)[AXIS_Y], z_mm = (*chord)[AXIS_Z];
    if (line->duration_s > 0.0f)
        return length_mm / line->duration_s;
    if ((line->flags & MOTION_FLAG_RAPID) != 0)
        return RAPID_MM_S;
    float linear_mm = sqrtf(x_mm * x_mm + y_mm * y_mm + z_mm * z_mm);
    return linear_mm > 0.0f ? line->feed_mm_s * (length_mm / linear_mm) : line->feed_mm_s;
}

/* What was taken so far is a chord of its own: no later move may change where it ends. */
static void plan_close(struct plan *plan) {
    struct reduce *reduce = &plan->reduce;
    if (!reduce->open)
        return;
    float length_mm = vec_length(reduce->chord);
    if (length_mm < MIN_CHORD_MM) {
        reduce->open = reduce->aimed = false; /* the next chord begins where this one did */
        return;
    }
    float away_mm = reduce_away_mm(reduce, length_mm, reduce_mm(plan->tolerance_mm));
    struct chord_info info = {.asked_mm_s = asked_mm_s(&plan->newest, &reduce->chord, length_mm),
                              .tube_mm = plan->tolerance_mm - away_mm,
                              .line = plan->first_line,
                              .note = plan->newest.note,
                              .units = power_close(&plan->power, length_mm),
                              .flags = plan->newest.flags};
    reduce_close(reduce);
    path_chord(&plan->path, &reduce->chord, length_mm, &info);
}

/* May the new move belong to the same chord as the newest one? */
static bool is_alike(const struct motion_line *a, const struct motion_line *b) {
    return a->feed_mm_s == b->feed_mm_s && a->flags == b->flags && a->note == b->note &&
           a->tolerance_mm == b->tolerance_mm && a->spent_mm == b->spent_mm && a->duration_s == 0.0f &&
           b->duration_s == 0.0f;
}

static bool leads_nowhere(const struct plan *plan, const struct motion_line *line) {
    bool same = true;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        same = same && line->target_mm[ax] == plan->position_mm[ax];
    return same;
}

/* The chord that a line has begun is too long: it gets an equal part of the line. */
static SELDOM float begin_part(struct plan *plan, const struct motion_line *line, float left_out_mm,
                               float longest_mm) {
    float part = 1.0f / (1.0f + (float)(uint32_t)(plan->reduce.reach_mm / longest_mm));
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        plan->position_mm[ax] += (double)part * (line->target_mm[ax] - plan->position_mm[ax]);
    plan->reduce.open = plan->reduce.aimed = false;
    (void)reduce_accepts(&plan->reduce, plan->position_mm, left_out_mm, longest_mm);
    plan->newest.duration_s *= part;
    plan->newest.flags &= (uint8_t)~MOTION_FLAG_EXACT_STOP;
    return part;
}

/* @return the part of it that became a chord, or belongs to one */
static float add_line(struct plan *plan, const struct motion_line *line, float longest_mm) {
    float tolerance_mm = max_f(plan->limits.junction_deviation_mm, line->tolerance_mm) - plan->shaped_mm;
    tolerance_mm = max_f(tolerance_mm, 0.0f);
    tolerance_mm = max_f(tolerance_mm - line->spent_mm, MIN_TOLERANCE * tolerance_mm);
    float left_out_mm = reduce_mm(tolerance_mm);
    bool begins = !plan->reduce.open;
    float rpm = (line->flags & MOTION_FLAG_CUT) != 0 ? line->rpm : 0.0f; /* only cuts burn */
    bool marks = rpm != power_rpm(&plan->power);
    uint32_t units = marks && !begins ? power_units(vec_length(plan->reduce.chord)) : 0;
    if (!is_alike(&plan->newest, line) ||
        !reduce_accepts(&plan->reduce, line->target_mm, left_out_mm, plan->merge_mm)) {
        plan_close(plan);
        begins = true;
        units = 0;
        plan->tolerance_mm = tolerance_mm;
        (void)reduce_accepts(&plan->reduce, line->target_mm, left_out_mm, plan->merge_mm);
    }
    if (begins)
        plan->first_line = line->line;
    if (marks)
        power_mark(&plan->power, plan->power.end + units, rpm);
    plan->newest = *line;
    plan->tolerance_mm = tolerance_mm;
    if (plan->reduce.reach_mm > longest_mm)
        return begin_part(plan, line, left_out_mm, longest_mm);
    memcpy(plan->position_mm, line->target_mm, sizeof plan->position_mm);
    return 1.0f;
}

/* The newest move ends at rest, exactly at its target.
 *  @param may_go_on  unless a next one comes early enough; else whatever follows */
static void plan_end(struct plan *plan, bool may_go_on) {
    int32_t steps[AXIS_COUNT] = {0};
    plan_close(plan);
    kinematics_target_steps(plan->position_mm, plan->limits.steps_per_mm, plan->limits.axis_count, steps);
    path_end(&plan->path, steps, may_go_on);
}

/* Append a move, or the part of it that is no longer than longest_mm; plan_free() is not 0.
 * @return that part of it, 1: all */
static float plan_line(struct plan *plan, const struct motion_line *line, float longest_mm) {
    float part = 1.0f;
    if (!leads_nowhere(plan, line))
        part = add_line(plan, line, longest_mm);
    plan->moves_total += part == 1.0f;
    if ((line->flags & MOTION_FLAG_EXACT_STOP) != 0 && part == 1.0f)
        plan_end(plan, false);
    DEBUG(DEBUG_MOTION, "move: line, pieces waiting", line->line, path_count(&plan->path));
    return part;
}

/* New overrides for everything planned. @param feed 0.1 .. 2, @param rapid 0.25 .. 1 */
static void plan_set_override(struct plan *plan, float feed, float rapid) {
    plan->timing.feed_sq = feed * feed;
    plan->timing.rapid_sq = rapid * rapid;
    plan->timing.whole = plan->path.head != plan->path.kept; /* what has yet to come is found with them */
}

/* When regular passes are made. What is not `reach` is for moves that wait for others, and for pieces that
 * may have to be travelled again. */
static struct timing timing_of(uint32_t look_ahead) {
    uint32_t step = 1;
    while (2 * step * PLAN_FRESH <= look_ahead)
        step *= 2;
    return (struct timing){.step = step, .reach = look_ahead / 8 * 5};
}

/* ---- the room's door ---- */

void motion_init(struct motion *motion, const struct motion_limits *limits, uint32_t look_ahead,
                 uint32_t laser_marks) {
    const int32_t zero[AXIS_COUNT] = {0};
    memset(&motion->plan, 0, sizeof motion->plan);
    motion->plan.look_ahead = look_ahead;
    motion->plan.timing = timing_of(look_ahead);
    motion->plan.power.most = laser_marks;
    motion->newest_us = motion->oldest_us = 0;
    motion->waits = motion->works = false;
    motion->queue.published = motion->queue.answered = 0;
    ahead_init(&motion->ahead, &motion->queue);
    emit_init(&motion->emit, &motion->plan, &motion->ahead);
    motion_set_limits(motion, limits);
    plan_set_override(&motion->plan, 1.0f, 1.0f);
    motion_reset(motion, zero);
}

void motion_set_limits(struct motion *motion, const struct motion_limits *limits) {
    plan_set_limits(&motion->plan, limits);
    emit_set_shaper(&motion->emit);
}

bool motion_in_range(const struct motion *motion, const double target_mm[AXIS_COUNT]) {
    return kinematics_in_range(target_mm, motion->plan.limits.steps_per_mm);
}

/* What of the last piece may still be changed. While a batch is pending nothing may: should it be refused,
 * motion continues as before. And nothing may while that end is the stop that the step interrupt may enter.
 */
static float slack_mm(struct motion *motion) {
    (void)ahead_take_answer(&motion->ahead);
    if (motion->plan.path.may_go_on && plan_is_pending(&motion->plan))
        ahead_abandon(&motion->ahead);
    return motion->ahead.pending || motion->ahead.ends ? 0.0f : emit_slack_mm(&motion->emit);
}

/* As much of it as plan_line() takes. @return 0: no room */
static float put_line(struct motion *motion, const struct motion_line *line, float longest_mm,
                      uint32_t now_us) {
    struct emit *emit = &motion->emit;
    if (!motion_has_room(motion) || (motion->plan.path.may_go_on && !ahead_open(&motion->ahead)))
        return 0.0f;
    ahead_close(&motion->ahead);
    if (plan_is_empty(&motion->plan))
        motion->oldest_us = now_us;
    motion->plan.path.slack_mm = slack_mm(motion);
    float part = plan_line(&motion->plan, line, longest_mm);
    emit->starved += emit->ran_dry;
    emit->ran_dry = emit->flush = false;
    motion->newest_us = now_us;
    return part;
}

bool motion_line(struct motion *motion, const struct motion_line *line, uint32_t now_us) {
    return put_line(motion, line, ALL_OF_IT, now_us) > 0.0f;
}

static SELDOM bool put_tool_line(struct motion *motion, struct joints *joints, const struct motion_line *line,
                                 uint32_t now_us) {
    /* Where axes stop in much more than LONGEST_MM, the look-ahead reaches as far. */
    const float longest_mm = max_f(LONGEST_MM, motion->plan.merge_mm);
    do {
        struct motion_line piece;
        const double end = joints_piece(joints, motion->plan.position_mm, line, &piece);
        const float part = put_line(motion, &piece, longest_mm, now_us);
        if (part == 0.0f)
            return false;
        if (part < 1.0f) {
            joints->done += (double)part * (end - joints->done);
            continue;
        }
        joints->done = end;
        joints->part *= 2.0;
        if (end < 1.0)
            continue;
        joints_arrive(joints, line->target_mm);
        return true;
    } while (motion_has_room(motion));
    return false;
}

/* A line that waits for room asks with every poll. */
bool motion_tool_line(struct motion *motion, struct joints *joints, const struct motion_line *line,
                      uint32_t now_us) {
    return motion_has_room(motion) && put_tool_line(motion, joints, line, now_us);
}

void motion_dwell(struct motion *motion, double seconds) {
    emit_dwell(&motion->emit, seconds);
}

void motion_gear(struct motion *motion, const struct gear_path *path) {
    emit_gear(&motion->emit, path);
}

static void flush(struct motion *motion, bool may_go_on) {
    const struct plan *plan = &motion->plan;
    bool again = motion->emit.flush && !plan_is_pending(plan) && (may_go_on || !plan->path.may_go_on);
    motion->emit.flush = true;
    motion->emit.ran_dry = false;
    if (again)
        return;
    motion->plan.path.slack_mm = slack_mm(motion);
    plan_end(&motion->plan, may_go_on);
}

void motion_flush(struct motion *motion) {
    flush(motion, true);
}

void motion_end(struct motion *motion) {
    flush(motion, false);
}

static bool rests_at_place(const struct emit *emit) {
    return emit->axes.v_mm_s == 0.0f && !emit->entered;
}

static bool rests_for_good(const struct motion *motion) {
    return rests_at_place(&motion->emit) && !motion->ahead.pending;
}

/* No move has come for a while. */
static bool is_idle(const struct motion *motion, uint32_t now_us) {
    return now_us - motion->newest_us >= MOTION_START_DELAY_US;
}

/* ... nor is one waited for where S changes so often that none can come before some are made. */
static bool is_paused(const struct motion *motion, uint32_t now_us) {
    return is_idle(motion, now_us) || !power_has_room(&motion->plan.power);
}

/* At rest, and more moves may still come that would give those here more look-ahead. */
static bool is_waiting(const struct motion *motion, uint32_t now_us) {
    const struct emit *emit = &motion->emit;
    bool resting = rests_at_place(emit) && !motion->ahead.pending &&
                   ahead_left_us(&motion->ahead) < (int32_t)(AHEAD_NEAR_US / 2);
    return resting && !is_paused(motion, now_us) && !emit->flush && !plan_is_empty(&motion->plan) &&
           motion_has_room(motion) && now_us - motion->oldest_us < MOTION_START_MAX_US;
}

/* Near the end of what is planned, moves that wait for others become pieces; and before motion starts because
 * no more have come although there is room, so that its plan does not depend on when that end would be found.
 */
static void plan_more(struct motion *motion, uint32_t now_us) {
    struct plan *plan = &motion->plan;
    if (!plan_is_pending(plan) || ahead_left_us(&motion->ahead) >= (int32_t)(AHEAD_NEAR_US / 2))
        return;
    bool starts = is_idle(motion, now_us) && power_has_room(&plan->power) && !motion->emit.hold &&
                  rests_for_good(motion);
    bool ends = starts || (!plan_is_long(plan) && emit_wants_more(&motion->emit));
    if (!ends || plan_free(plan) == 0 || motion_end_is_pending(motion))
        return;
    plan->path.slack_mm = slack_mm(motion);
    if (is_paused(motion, now_us))
        plan_end(plan, true);
    else
        plan_close(plan);
}

/* Pieces that one poll looks at, and those that the next batch may need. */
#define PIECES_AT_ONCE 3u
#define PIECES_AHEAD   32u

/* A backward pass is to be made. One that is not regular only where motion needs it soon: else what comes
 * next would depend on when it was made. */
static bool wants_pass(const struct motion *motion) {
    if (plan_has_pass(&motion->plan))
        return true;
    bool soon = ahead_left_us(&motion->ahead) < (int32_t)AHEAD_LEAST_US || rests_for_good(motion);
    return soon && !motion->waits && !plan_is_timed(&motion->plan, PIECES_AHEAD);
}

/* The plan's timing is as good as it can be, or must do: a hold does not need it, and where motion is needed
 * now the emitter itself looks at all the rest. @return false: call again */
static bool is_timed(struct motion *motion) {
    if (!wants_pass(motion))
        return true;
    bool late = motion->emit.hold || ahead_left_us(&motion->ahead) < (int32_t)AHEAD_BRANCH_US;
    if (late && !rests_for_good(motion))
        return true;
    (void)plan_time(&motion->plan, PIECES_AT_ONCE);
    return false;
}

/* The same where enough is published: most polls end here. */
static bool stays_timed(struct motion *motion) {
    return (!plan_has_pass(&motion->plan) && !rests_at_place(&motion->emit)) || is_timed(motion);
}

/* More is to be published, now or soon. */
static SELDOM bool publish_more(struct motion *motion, uint32_t now_us) {
    struct emit *emit = &motion->emit;
    motion->works = false;
    emit->waits = motion->waits = !ahead_is_making(&motion->ahead) && is_waiting(motion, now_us);
    if (!emit->waits)
        plan_more(motion, now_us);
    if (motion->ahead.owner != AHEAD_PLANNER && (emit_is_idle(emit) || emit_is_held(emit)))
        return false;
    motion->works = !is_timed(motion);
    if (motion->works)
        return true;
    bool any = emit_claim(emit) && ahead_poll(&motion->ahead);
    motion->works = ahead_is_making(&motion->ahead);
    return any;
}

bool motion_poll(struct motion *motion, uint32_t now_us) {
    motion->emit.now_us = now_us;
    if (motion->ahead.owner != AHEAD_PLANNER || !ahead_has_enough(&motion->ahead))
        return publish_more(motion, now_us);
    motion->emit.waits = motion->waits = false;
    motion->works = !stays_timed(motion);
    return motion->works;
}

void motion_hold(struct motion *motion) {
    emit_hold(&motion->emit, true);
}

void motion_resume(struct motion *motion) {
    emit_hold(&motion->emit, false);
}

bool motion_is_held(const struct motion *motion) {
    return emit_is_held(&motion->emit);
}

void motion_set_override(struct motion *motion, float feed, float rapid) {
    const struct timing *timing = &motion->plan.timing;
    float feed_sq = timing->feed_sq, rapid_sq = timing->rapid_sq;
    plan_set_override(&motion->plan, feed, rapid);
    if (timing->feed_sq != feed_sq || timing->rapid_sq != rapid_sq)
        emit_change_limits(&motion->emit);
}

bool motion_is_planned_out(const struct motion *motion) {
    return emit_is_idle(&motion->emit);
}

void motion_shift(struct motion *motion, const int32_t steps[AXIS_COUNT]) {
    struct plan *plan = &motion->plan;
    struct path *path = &plan->path;
    double way_mm[AXIS_COUNT];
    kinematics_position_mm(steps, plan->limits.steps_per_mm, way_mm);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        plan->position_mm[ax] += way_mm[ax];
        plan->newest.target_mm[ax] += way_mm[ax];
        plan->reduce.anchor_mm[ax] += way_mm[ax];
        for (uint32_t stop = path->stop_tail; stop != path->stop_head; stop++)
            path->stop_steps[stop & (PATH_STOPS - 1)][ax] += steps[ax];
    }
    emit_shift(&motion->emit, steps);
}

static void widen(const double at_mm[AXIS_COUNT], double low_mm[AXIS_COUNT], double high_mm[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        low_mm[ax] = at_mm[ax] < low_mm[ax] ? at_mm[ax] : low_mm[ax];
        high_mm[ax] = at_mm[ax] > high_mm[ax] ? at_mm[ax] : high_mm[ax];
    }
}

static void walk(double at_mm[AXIS_COUNT], const vec *way, double low_mm[AXIS_COUNT],
                 double high_mm[AXIS_COUNT]) {
    float way_mm[AXIS_COUNT] = {0};
    vec_store(*way, way_mm);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        at_mm[ax] += (double)way_mm[ax];
    widen(at_mm, low_mm, high_mm);
}

/* From control point to control point, of pieces and then of knots that are none yet. */
void motion_bounds(const struct motion *motion, double low_mm[AXIS_COUNT], double high_mm[AXIS_COUNT]) {
    const struct plan *plan = &motion->plan;
    const struct path *path = &plan->path;
    double at_mm[AXIS_COUNT];
    kinematics_position_mm(motion->emit.axes.steps, plan->limits.steps_per_mm, at_mm);
    memcpy(low_mm, at_mm, sizeof at_mm);
    memcpy(high_mm, at_mm, sizeof at_mm);
    widen(plan->position_mm, low_mm, high_mm);
    emit_corner_mm(&motion->emit, at_mm);
    widen(at_mm, low_mm, high_mm);
    for (uint32_t i = path->tail + (motion->emit.entered ? 1u : 0u); (int32_t)(path->head - i) > 0; i++) {
        const struct piece *piece = &path->pieces[i & (PLAN_SIZE - 1)];
        const vec chord = piece->unit * piece->length_mm;
        walk(at_mm, &chord, low_mm, high_mm);
    }
    for (uint32_t i = path->blended + 1; (int32_t)(path->newest - i) >= 0; i++)
        walk(at_mm, &path->knots[i & (KNOT_RING - 1)].chord, low_mm, high_mm);
    widen(plan->reduce.anchor_mm, low_mm, high_mm);
}

void motion_reset(struct motion *motion, const int32_t position_steps[AXIS_COUNT]) {
    plan_reset(&motion->plan, position_steps);
    emit_reset(&motion->emit, position_steps);
    ahead_reset(&motion->ahead);
}
