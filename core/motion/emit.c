/* SPDX-License-Identifier: MIT */
#include "motion/emit.h"

#include "base/debug.h"
#include "motion/emit_place.h"
#include "motion/emit_power.h"
#include "motion/emit_stop.h"
#include "motion/forward.h"

#include <math.h>
#include <string.h>

#define LINE_SAMPLE_S 0.004f  /* of a segment, on a straight part that continues for longer */
#define MIN_SAMPLE_S  0.0002f /* where the acceleration changes */
#define REST_NS       1000u   /* less of it at the end of a sample is rounding */
#define GEAR_SAMPLE_S 0.002f  /* of motion that follows the spindle */
#define ENOUGH_MM     0.5f  /* and a little more than the way to a stop: no more of the path is needed yet */
#define SLACK_USED    1.01f /* of the way to a stop, for rounding */
#define ARRIVES       (PIECE_STOP | PIECE_ARRIVE) /* the axes come there, then the path continues */
#define CORNER_SHIFT  (EMIT_CORNER_BITS - 16)     /* to units of HISTORY_STEP */
#define SHORT_UNITS   0x1p31f                     /* of HISTORY_STEP: they fit a word */
#define MAX_DWELL_NS  20000000u                   /* of one dwell segment */
#define END_S         0.05f                       /* and so much: the end of the path is the stop */
#define PORTION 7u /* stretches of the path in a batch that one poll makes; a segment counts as one more, */
#define SHAPED_WORK 3u /* and if a shaper makes it as so many more again */

void emit_init(struct emit *emit, struct plan *plan, struct ahead *ahead) {
    memset(emit, 0, sizeof *emit);
    emit->plan = plan;
    emit->ahead = ahead;
}

static void stand_still(struct emit *emit) {
    int64_t at[SHAPER_LANES];
    for (unsigned ax = 0; ax < CORE_AXES; ax++)
        at[ax] = axes_exactly_on(emit->axes.steps[ax]);
    at[SHAPER_PLACE] = emit->power.at;
    memcpy(emit->lent_in, at, sizeof at);
    history_rest(&emit->history, emit->lent ? emit->history.now.in : at);
}

/* At rest, maybe in a stop that will be taken back. */
static void choose_shaper(struct emit *emit, bool unshaped) {
    const struct shaper *shaper = unshaped ? &emit->plan->unshaped : &emit->plan->shaper;
    if (shaper == emit->axes.shaper)
        return;
    emit->axes.shaper = shaper;
    stand_still(emit);
}

static double steps_of(const struct emit *emit, unsigned axis) {
    return (double)emit->plan->limits.steps_per_mm[axis];
}

void emit_reset(struct emit *emit, const int32_t position_steps[AXIS_COUNT]) {
    emit->entered = emit->on_blend = emit->flush = emit->hold = emit->hold_asked = emit->late =
        emit->ran_dry = false;
    emit->settles = emit->waits = emit->slope.known = emit->lent = false;
    emit->gear.phase = GEAR_OFF;
    emit->y = emit->axes.v_mm_s = emit->path_mm_s = emit->ramp = 0.0f;
    emit->along_mm = emit->along_rest_mm = 0.0f;
    emit->dwell_ns = emit->dwelt_ns = 0;
    emit->stop = AHEAD_GO;
    emit->piece_at = 0;
    emit->power = (struct power_place){0};
    axes_rest(&emit->axes, position_steps);
    for (unsigned ax = 0; ax < CORE_AXES; ax++)
        emit->corner[ax] = (int64_t)(emit->plan->position_mm[ax] * steps_of(emit, ax) * (double)EMIT_CORNER);
    stand_still(emit);
}

void emit_set_shaper(struct emit *emit) {
    emit->axes.shaper = &emit->plan->shaper;
    stand_still(emit);
}

/* The axes follow where the path was: they are still under way when it has ended. */
static bool is_behind(const struct emit *emit) {
    return !emit->lent && history_moves(&emit->history, emit->axes.shaper);
}

static bool dwells(const struct emit *emit) {
    return emit->dwell_ns != emit->dwelt_ns;
}

bool emit_is_idle(const struct emit *emit) {
    return plan_is_empty(emit->plan) && !dwells(emit) && !is_behind(emit) && !gear_is_on(&emit->gear);
}

bool emit_is_held(const struct emit *emit) {
    return emit->hold && emit->y == 0.0f && !is_behind(emit) && !gear_is_on(&emit->gear);
}

/* What limited jerk makes the way to a stop longer by at most, at speed^2 y: it may have to speed up for one
 * mean before, and brake gently for another. */
static float ramp_mm(const struct path *path, float accel_mm_s2, float y) {
    float mean_s = path->mean_s;
    return mean_s > 0.0f ? 2.0f * mean_s * (sqrtf(y) + path->near_part * accel_mm_s2 * mean_s) : 0.0f;
}

float emit_slack_mm(const struct emit *emit) {
    const struct path *path = &emit->plan->path;
    if (path_count(path) == 0)
        return 0.0f;
    const struct piece *last = &path->pieces[(path->head - 1) & (PLAN_SIZE - 1)];
    bool on_it = path_count(path) == 1 && emit->entered;
    float before_mm = path->pieces[(path->head - 2) & (PLAN_SIZE - 1)].tangent_mm;
    float left_mm = last->length_mm - (on_it ? emit->along_mm : path_count(path) > 1 ? before_mm : 0.0f);
    float y = on_it ? emit->y : path_count(path) > 1 ? last->enter_y : 0.0f;
    return left_mm - SLACK_USED * y / (2.0f * last->accel_mm_s2) - ramp_mm(path, last->accel_mm_s2, y);
}

uint32_t emit_line(const struct emit *emit) {
    const struct path *path = &emit->plan->path;
    if (gear_is_on(&emit->gear))
        return emit->gear.path.line;
    return emit->entered ? path->pieces[path->tail & (PLAN_SIZE - 1)].line : 0;
}

void emit_dwell(struct emit *emit, double seconds) {
    emit->dwell_ns += (uint64_t)(seconds * 1e9 + 0.5);
}

static void change(struct emit *emit) {
    if (emit->ahead->owner == AHEAD_PLANNER)
        ahead_change(emit->ahead);
}

void emit_hold(struct emit *emit, bool on) {
    if (emit->hold_asked == on)
        return;
    emit->hold = emit->hold_asked = on;
    change(emit);
}

void emit_set_beam(struct emit *emit, const struct beam *beam) {
    if (beam_is_same(&emit->beam, beam))
        return;
    emit->beam = *beam;
    change(emit);
}

void emit_change_limits(struct emit *emit) {
    emit->late = true;
    emit->limits++;
    change(emit);
}

/* From here to the end of the pieces it is `times` the way to a stop and `more_mm`, or less. */
static bool is_near_end(const struct emit *emit, float times, float more_mm) {
    struct path *path = &emit->plan->path;
    float left = 0.5f * times * emit->y, skip_mm = more_mm + emit->along_mm;
    if (path_count(path) > 0)
        skip_mm += ramp_mm(path, path_piece(path, path->tail)->accel_mm_s2, emit->y);
    for (uint32_t i = path->tail; i != path->head; i++) {
        const struct piece *piece = path_piece(path, i);
        float way_mm = piece->length_mm - skip_mm;
        skip_mm = max_f(-way_mm, 0.0f);
        if (way_mm <= 0.0f)
            continue;
        float slow_mm = path->near_part < 1.0f ? piece_slow_mm(piece, path_piece(path, i - 1)) : 0.0f;
        left -= piece->accel_mm_s2 * (way_mm - (1.0f - path->near_part) * min_f(slow_mm, way_mm));
        if (left < 0.0f)
            return false;
    }
    return true;
}

bool emit_wants_more(const struct emit *emit) {
    if (travel_ends(emit) && !emit->hold) /* it may have started too near to the end to ask on its way */
        return true;
    return is_near_end(emit, 2.0f, ENOUGH_MM); /* some of it bends */
}

/* A place of an axis, as axes_exactly_on(). */
static int64_t in_units(double place_mm, float steps_per_mm) {
    double units = (place_mm * (double)steps_per_mm + 0.5) * (double)HISTORY_STEP;
    return (int64_t)(units + (units < 0.0 ? -0.5 : 0.5));
}

/* Where the path is, as axes_exactly_on(): the corner exactly, and from there in single precision.
 * @return its speed */
static float find_steps(const struct emit *emit, int64_t at[CORE_AXES]) {
    float rest_mm[AXIS_COUNT];
    const float mm_s = travel_position(emit, rest_mm);
    for (unsigned ax = 0; ax < emit->plan->limits.axis_count; ax++) {
        float rest = rest_mm[ax] * emit->plan->limits.steps_per_mm[ax] * (float)HISTORY_STEP;
        int64_t units = fabsf(rest) < SHORT_UNITS ? (int32_t)rest : (int64_t)rest; /* in hardware */
        at[ax] = (emit->corner[ax] >> CORNER_SHIFT) + HISTORY_STEP / 2 + units;
    }
    return mm_s;
}

/* The piece before tail has ended in a stop: take the exact target. */
static void take_stop(struct emit *emit, int64_t at[CORE_AXES]) {
    struct path *path = &emit->plan->path;
    const int32_t *steps = path->stop_steps[path->stop_tail++ & (PATH_STOPS - 1)];
    for (unsigned ax = 0; ax < CORE_AXES; ax++)
        at[ax] = axes_exactly_on(steps[ax]);
}

static uint8_t segment_flags(uint8_t motion_flags) {
    uint8_t flags = 0;
    flags |= (motion_flags & MOTION_FLAG_RAPID) != 0 ? SEGMENT_RAPID : 0;
    flags |= (motion_flags & MOTION_FLAG_PROBE) != 0 ? SEGMENT_PROBE : 0;
    flags |= (motion_flags & MOTION_FLAG_JOG) != 0 ? SEGMENT_JOG : 0;
    flags |= (motion_flags & MOTION_FLAG_CUT) != 0 ? SEGMENT_CUT : 0;
    return flags;
}

/* What a segment says of itself besides its motion must be the same all through it. */
static bool is_other(const struct piece *a, const struct piece *b) {
    return a->flags != b->flags || a->note != b->note;
}

static float sample_s(const struct emit *emit, const struct piece *piece) {
    bool stops = emit->stop != AHEAD_GO;
    if (emit->stop == AHEAD_STOP)
        return emit_stop_sample_s(emit);
    if (emit->on_blend)
        return emit->plan->curve_s;
    float line_s = stops ? emit->stop_most_s : LINE_SAMPLE_S;
    float left_mm = piece->length_mm - piece->tangent_mm - emit->along_mm;
    float longest_mm = (emit->axes.v_mm_s + (stops ? 0.0f : piece->accel_mm_s2 * line_s)) * line_s;
    return left_mm > 1.5f * longest_mm ? line_s : emit->plan->curve_s;
}

/* To travel on, it must be known how fast. @return it is; else a pass was made */
static bool need_timing(struct emit *emit) {
    if (emit->stop != AHEAD_GO || emit->hold || plan_is_timed(emit->plan, 0))
        return true;
    (void)plan_time(emit->plan, UINT32_MAX);
    return false;
}

/* Travel for one sample, or to a stop, or to where another kind of motion begins. @return s */
static float travel_sample(struct emit *emit, const struct piece *piece) {
    const uint32_t *tail = &emit->plan->path.tail;
    float most_s = sample_s(emit, path_piece(&emit->plan->path, *tail)), time_s = 0.0f;
    uint32_t timed_at = *tail - 1u;
    while (time_s < most_s) {
        if (timed_at != *tail && need_timing(emit))
            timed_at = *tail;
        float asked_s = most_s - time_s, took_s = travel(emit, asked_s);
        emit->work++;
        time_s += took_s;
        if (travel_ends(emit) || !emit->entered)
            break;
        if (time_s >= most_s || is_other(piece, travel_piece(emit)))
            break;
        if (emit->stop == AHEAD_STOP)
            most_s = min_f(most_s, emit_stop_sample_s(emit));
        else if (!emit->on_blend && took_s < asked_s) { /* the acceleration changes here */
            if (time_s > MIN_SAMPLE_S)
                break;
            most_s = emit->plan->curve_s;
        }
    }
    return time_s;
}

/* Travel for this time, or to an exact stop. @return s */
static float travel_time(struct emit *emit, float time_s) {
    const struct path *path = &emit->plan->path;
    float left_s = time_s;
    while (left_s > 0.0f && !travel_ends(emit)) {
        (void)need_timing(emit);
        left_s -= travel(emit, left_s);
        emit->work++;
        if (!emit->entered && (path->pieces[(path->tail - 1) & (PLAN_SIZE - 1)].flags & ARRIVES) != 0)
            break;
    }
    return time_s - left_s;
}

/* Where the path has come to; at a stop, exactly there. @return the piece that says what this is */
static const struct piece *find_place(struct emit *emit, int64_t at[CORE_AXES]) {
    struct path *path = &emit->plan->path;
    bool stop = !emit->entered;
    const struct piece *last = path_piece(path, stop ? path->tail - 1 : path->tail);
    float mm_s = 0.0f;
    if (stop && (last->flags & PIECE_STOP) != 0)
        take_stop(emit, at);
    else
        mm_s = find_steps(emit, at);
    emit->path_mm_s = stop ? 0.0f : mm_s;
    if (emit->y == 0.0f) {
        bool asked = (last->flags & MOTION_FLAG_EXACT_STOP) != 0;
        bool may_end = asked || emit->flush || emit->hold || (last->flags & MOTION_FLAG_JOG) != 0;
        emit->ran_dry = travel_ends(emit) && !may_end;
        emit->ended_flags = last->flags;
    }
    return last;
}

/* What every segment says. */
static void finish(struct emit *emit, struct segment *segment, uint32_t ns) {
    if (emit->axes.v_mm_s == 0.0f) {
        if ((emit->ended_flags & MOTION_FLAG_EXACT_STOP) != 0 && !emit->entered)
            segment->flags |= SEGMENT_EXACT_STOP;
        if (plan_is_empty(emit->plan) || emit->hold)
            segment->flags |= SEGMENT_LAST;
    }
    segment->id = emit->next_id++;
    segment->duration_ns = ns;
    segment->v_mm_s = emit->axes.v_mm_s;
    DEBUG(DEBUG_MOTION, "segment: line, ns", segment->line, segment->duration_ns);
}

static void make_sample(struct emit *emit, struct segment *segment) {
    const struct piece *piece = travel_piece(emit);
    float v0 = emit->axes.v_mm_s, time_s = travel_sample(emit, piece);
    int64_t at[CORE_AXES] = {0};
    segment->flags = segment_flags(piece->flags);
    segment->line = find_place(emit, at)->line;
    emit->axes.v_mm_s = emit->path_mm_s;
    segment->ramp = axes_ramp(v0, emit->axes.v_mm_s);
    axes_go(&emit->axes, segment, at, emit->plan->limits.axis_count);
    if (emit_power_counts(emit))
        emit_power(emit, segment, piece, travel_power_place(emit), v0, emit->axes.v_mm_s, time_s);
    else
        emit->power.at = emit->piece_at; /* near enough: nothing is marked up to the end of the path */
    finish(emit, segment, axes_ns(&emit->axes, time_s));
}

/* What belongs to the shaped motion; that of a host has left others there. */
static const struct piece *shape_piece(const struct emit *emit) {
    return path_piece(&emit->plan->path, emit->shape.piece);
}

/* The path continues for this time, or to a stop, or it rests until the axes do, too.
 * @return the piece that belongs to it; *time_s becomes the time that the sample takes, *took_s that of the
 * way */
static const struct piece *travel_shaped(struct emit *emit, int64_t at[SHAPER_LANES], float *time_s,
                                         float *took_s) {
    const struct piece *piece = shape_piece(emit);
    *took_s = 0.0f;
    if (emit->settles || travel_ends(emit)) {
        float left_s = (float)(emit->axes.shaper->window_ns - emit->history.now.still_ns) * 1e-9f;
        *time_s = max_f(min_f(*time_s, left_s), MIN_SAMPLE_S);
        return piece;
    }
    *took_s = travel_time(emit, *time_s);
    *time_s = max_f(*took_s, MIN_SAMPLE_S);
    piece = find_place(emit, at);
    at[SHAPER_PLACE] += (int32_t)(travel_power_place(emit) - (uint32_t)at[SHAPER_PLACE]);
    emit->settles = !emit->entered && (emit->ended_flags & ARRIVES) != 0;
    return piece;
}

/* What was travelled is over; the rest of the sample the path rests. */
static void push_sample(struct emit *emit, const int64_t at[SHAPER_LANES], float took_s, uint32_t ns,
                        float v0, const struct piece *piece) {
    uint32_t took_ns = (uint32_t)(took_s * 1e9f);
    uint16_t index = (uint16_t)(piece - emit->plan->path.pieces);
    if (took_ns == 0 || took_ns + REST_NS > ns)
        took_ns = ns;
    uint8_t side = emit->ahead->side ^ 1u;
    history_push(&emit->history, at, took_ns, axes_ramp(v0, emit->path_mm_s), index, side);
    if (took_ns < ns)
        history_push(&emit->history, at, ns - took_ns, 0, index, side);
    history_shape(&emit->history, emit->axes.shaper, &emit->shape);
}

/* Steps to where the shaper has the axes. @return as axes_follow() */
static float follow(struct emit *emit, struct segment *segment, float time_s) {
    return axes_follow(&emit->axes, segment, &emit->shape, is_behind(emit), &emit->plan->limits, time_s);
}

/* A sample of the path, and where the axes are after it. */
static void make_shaped(struct emit *emit, struct segment *segment) {
    float took_s, time_s = emit_stop_longer_s(emit, emit->axes.v_mm_s, emit->axes.shaper->sample_s),
                  v0 = emit->axes.v_mm_s, path_v0 = emit->path_mm_s;
    int64_t at[SHAPER_LANES];
    memcpy(at, emit->history.now.in, sizeof at);
    const struct piece *piece = travel_shaped(emit, at, &time_s, &took_s);
    uint32_t ns = axes_ns(&emit->axes, time_s);
    push_sample(emit, at, took_s, ns, path_v0, piece);
    emit->settles = emit->settles && is_behind(emit);
    piece = shape_piece(emit);
    segment->line = piece->line;
    segment->flags = segment_flags(piece->flags);
    float part = follow(emit, segment, time_s);
    emit_power(emit, segment, piece, (uint32_t)emit->shape.out[SHAPER_PLACE], part * v0,
               part * emit->axes.v_mm_s, time_s);
    finish(emit, segment, ns);
}

void emit_gear(struct emit *emit, const struct gear_path *path) {
    choose_shaper(emit, true);
    gear_begin(&emit->gear, path);
    emit->gear.path.lag_s = (float)emit->axes.shaper->late_ns * 1e-9f;
}

/* Where the follower is, as axes_exactly_on(); at its end it rests on a step. */
static void find_geared(const struct emit *emit, int64_t at[CORE_AXES]) {
    const struct plan *plan = emit->plan;
    double place_mm[AXIS_COUNT];
    gear_position(&emit->gear, place_mm);
    for (unsigned ax = 0; ax < plan->limits.axis_count; ax++) {
        at[ax] = in_units(place_mm[ax], plan->limits.steps_per_mm[ax]);
        if (emit->gear.phase == GEAR_DONE)
            at[ax] = axes_exactly_on((int32_t)(at[ax] >> 16));
    }
}

/* The next sample of the follower. While it waits for its angle, time continues and nothing moves. */
static void make_geared(struct emit *emit, struct segment *segment) {
    struct gear *gear = &emit->gear;
    bool shaped = shaper_is_on(emit->axes.shaper), waits = gear->phase == GEAR_WAITS;
    float asked_s = shaped ? emit->axes.shaper->sample_s
                           : emit_stop_longer_s(emit, emit->axes.v_mm_s, GEAR_SAMPLE_S),
          v0 = fabsf(gear->v_mm_s);
    double time_s = gear_sample(gear, &emit->spindle, asked_s, shaped, emit->now_us);
    uint32_t ns = axes_ns(&emit->axes, (float)time_s);
    segment->line = gear->path.line;
    if (waits) {
        segment->flags = SEGMENT_DWELL;
        memset(segment->phase, SEGMENT_PHASE_HALF, sizeof segment->phase);
        memset(segment->phase_end, SEGMENT_PHASE_HALF, sizeof segment->phase_end);
    } else {
        int64_t at[SHAPER_LANES] = {0};
        memcpy(at, emit->history.now.in, sizeof at);
        find_geared(emit, at);
        emit->path_mm_s = fabsf(gear->v_mm_s);
        if (shaped) {
            push_sample(emit, at, (float)time_s, ns, v0, shape_piece(emit));
            (void)follow(emit, segment, (float)time_s);
        } else {
            segment->ramp = axes_ramp(v0, emit->path_mm_s);
            emit->axes.v_mm_s = emit->path_mm_s;
            axes_go(&emit->axes, segment, at, emit->plan->limits.axis_count);
        }
    }
    finish(emit, segment, ns);
}

static void make_dwell(struct emit *emit, struct segment *segment) {
    uint64_t left_ns = emit->dwell_ns - emit->dwelt_ns;
    segment->duration_ns = (uint32_t)(left_ns < MAX_DWELL_NS ? left_ns : MAX_DWELL_NS);
    segment->id = emit->next_id++;
    segment->flags = SEGMENT_DWELL;
    emit->dwelt_ns += segment->duration_ns;
}

/* ---- as a source of segments ---- */

static bool make(void *ctx, struct segment *segment) {
    struct emit *emit = ctx;
    if (emit->waits || emit_is_idle(emit) || emit_is_held(emit))
        return false;
    if (!gear_is_on(&emit->gear) && !emit->entered && !is_behind(emit) && path_count(&emit->plan->path) > 0)
        choose_shaper(emit, (travel_piece(emit)->flags & MOTION_FLAG_UNSHAPED) != 0);
    if (shaper_is_on(emit->axes.shaper) && !history_has_room(&emit->history, emit->ahead->side ^ 1u))
        return false;
    emit->work = 1;
    if (gear_is_on(&emit->gear))
        make_geared(emit, segment);
    else if (travel_ends(emit) && !is_behind(emit)) {
        if (!dwells(emit))
            return false;
        make_dwell(emit, segment);
    } else if (shaper_is_on(emit->axes.shaper))
        make_shaped(emit, segment);
    else
        make_sample(emit, segment);
    emit->stop_samples++;
    emit->gear.run_ns += segment->duration_ns; /* the axes come to rest later than the follower that stops */
    return true;
}

static bool rests(const void *ctx) {
    const struct emit *emit = ctx;
    bool geared = gear_is_on(&emit->gear) && emit->gear.phase != GEAR_WAITS;
    return emit->y == 0.0f && !is_behind(emit) && !geared;
}

/* Later moves cannot change what comes next: all pieces of a segment, where their sender keeps up; or not
 * much, while those that there are are few. */
static bool is_firm(const struct emit *emit) {
    const struct plan *plan = emit->plan;
    if (dwells(emit) && travel_ends(emit))
        return false;
    if (emit->hold || path_count(&plan->path) == 0 || (path_is_closed(&plan->path) && !plan->reduce.open))
        return true;
    if (plan_is_long(plan))
        return plan_is_final(plan, plan->timing.step / 2);
    return plan_is_final(plan, 0) || !emit_wants_more(emit);
}

static uint32_t reach_us(const void *ctx) {
    const struct emit *emit = ctx;
    if (gear_is_on(&emit->gear))
        return AHEAD_SOON_US;
    if (!is_firm(emit))
        return AHEAD_NEAR_US;
    /* Nearer where something is sought (homing, probing), and for want of records (motion/history.h). */
    return emit->axes.shaper == &emit->plan->unshaped || shaper_is_on(emit->axes.shaper) ? AHEAD_FULL_US
                                                                                         : AHEAD_FAR_US;
}

static uint32_t news(const void *ctx) {
    const struct emit *emit = ctx;
    return emit->plan->moves_total;
}

/* An end that is about to be passed at speed is none: the shortest stop leaves emit_slack_mm() alone. */
static bool ends_soon(const struct emit *emit) {
    const struct plan *plan = emit->plan;
    bool goes_on = plan->path.may_go_on && plan_is_pending(plan);
    return !gear_is_on(&emit->gear) && !goes_on && is_near_end(emit, 3.0f, END_S * emit->axes.v_mm_s);
}

static void go_on(void *ctx, enum ahead_stop how) {
    struct emit *emit = ctx;
    emit->stop = how;
    emit->hold = how == AHEAD_STOP || emit->hold_asked;
}

static bool stop(void *ctx, enum ahead_stop how) {
    struct emit *emit = ctx;
    emit_stop_begin(emit);
    go_on(emit, how);
    if (how == AHEAD_STOP)
        gear_brake(&emit->gear);
    return how != AHEAD_END || ends_soon(emit);
}

/* What follows the spindle is made whole: the spindle turns meanwhile. */
static uint32_t portion(const void *ctx) {
    const struct emit *emit = ctx;
    return gear_is_on(&emit->gear) ? UINT32_MAX : PORTION;
}

static uint32_t work(const void *ctx) {
    const struct emit *emit = ctx;
    return emit->work + (shaper_is_on(emit->axes.shaper) ? SHAPED_WORK : 0u);
}

void emit_lend(struct emit *emit) {
    memcpy(emit->lent_in, emit->history.now.in, sizeof emit->lent_in);
    emit->lent = true;
}

static void take_back(struct emit *emit) {
    emit->lent = false;
    history_rest(&emit->history, emit->lent_in);
    emit_save(emit, emit->ahead->commit);
}

bool emit_claim(struct emit *emit) {
    static const struct ahead_source source = {.make = make,
                                               .rests = rests,
                                               .reach_us = reach_us,
                                               .news = news,
                                               .stop = stop,
                                               .portion = portion,
                                               .work = work,
                                               .go_on = go_on,
                                               .save = emit_save,
                                               .load = emit_load,
                                               .release = emit_release};
    if (!ahead_claim(emit->ahead, AHEAD_PLANNER, &source, emit))
        return false;
    if (emit->lent)
        take_back(emit);
    return true;
}
