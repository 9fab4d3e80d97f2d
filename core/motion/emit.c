/* SPDX-License-Identifier: MIT */
#include "motion/emit.h"

#include "base/debug.h"
#include "motion/travel.h"

#include <math.h>
#include <string.h>

#define SAMPLE_S       0.002f /* of a segment: a curve at 500 mm/s2 is 0.25 um beside its chord then */
#define LINE_SAMPLE_S  0.004f /* on a straight part that goes on for longer */
#define LEAST_SAMPLE_S 0.0002f
#define ENOUGH_MM      0.5f /* and a little more than the way to a stop: no more of the path is needed yet */
#define MAX_DWELL_NS   1000000000u /* of one dwell segment */

void emit_init(struct emit *emit, struct plan *plan, struct segment_ring *ring) {
    *emit = (struct emit){.plan = plan, .ring = ring};
}

void emit_reset(struct emit *emit, const int32_t position_steps[AXIS_COUNT]) {
    emit->entered = emit->on_blend = emit->flush = emit->hold = emit->late = emit->ran_dry = false;
    emit->y = emit->v_mm_s = emit->t = 0.0f;
    emit->along_mm = 0.0;
    emit->dwell_left_ns = 0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        emit->corner_mm[ax] = emit->plan->position_mm[ax];
        emit->steps[ax] = position_steps[ax];
        emit->fraction[ax] = SEGMENT_PHASE_HALF;
    }
}

bool emit_is_idle(const struct emit *emit) {
    return plan_is_empty(emit->plan) && emit->dwell_left_ns == 0;
}

bool emit_is_held(const struct emit *emit) {
    return emit->hold && emit->y == 0.0f;
}

uint32_t emit_line(const struct emit *emit) {
    const struct path *path = &emit->plan->path;
    return emit->entered ? path->pieces[path->tail & (PLAN_SIZE - 1)].line : 0;
}

float emit_speed_mm_s(const struct emit *emit) {
    return emit->v_mm_s;
}

void emit_dwell(struct emit *emit, double seconds) {
    emit->dwell_left_ns = (uint64_t)(seconds * 1e9 + 0.5);
}

bool emit_wants_more(const struct emit *emit) {
    const struct path *path = &emit->plan->path;
    float ahead_mm = -ENOUGH_MM - (float)emit->along_mm;
    for (uint32_t i = path->tail; i != path->head; i++) {
        const struct piece *piece = &path->pieces[i & (PLAN_SIZE - 1)];
        ahead_mm += piece->length_mm;
        if (ahead_mm * piece->accel_mm_s2 > emit->y) /* twice the way to a stop: some of it bends */
            return false;
    }
    return true;
}

/* Where the axes are, to the step and 1/256 of it. At a stop that is exactly on a step. */
static void find_steps(const struct emit *emit, int32_t steps[AXIS_COUNT], uint8_t fraction[AXIS_COUNT]) {
    const struct plan *plan = emit->plan;
    float rest_mm[AXIS_COUNT];
    travel_position(emit, rest_mm);
    for (unsigned ax = 0; ax < plan->limits.axis_count; ax++) {
        double exact =
            (emit->corner_mm[ax] + (double)rest_mm[ax]) * (double)plan->limits.steps_per_mm[ax] + 0.5;
        double whole = floor(exact);
        steps[ax] = (int32_t)whole;
        fraction[ax] = (uint8_t)((exact - whole) * 256.0);
    }
}

/* The piece at tail has ended in a stop: take the exact target. */
static void take_stop(struct emit *emit, int32_t steps[AXIS_COUNT], uint8_t fraction[AXIS_COUNT]) {
    struct path *path = &emit->plan->path;
    memcpy(steps, path->stop_steps[path->stop_tail++ & (PATH_STOPS - 1)], sizeof path->stop_steps[0]);
    memset(fraction, SEGMENT_PHASE_HALF, AXIS_COUNT);
}

/* Steps and phases from where the last segment ended to here. */
static void set_axes(struct emit *emit, struct segment *segment, const int32_t steps[AXIS_COUNT],
                     const uint8_t fraction[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        int32_t count = steps[ax] - emit->steps[ax];
        bool down = count < 0;
        segment->steps[ax] = (int16_t)count;
        segment->phase[ax] = (uint8_t)(down ? 255 - emit->fraction[ax] : emit->fraction[ax]);
        segment->phase_end[ax] = (uint8_t)(down ? 255 - fraction[ax] : fraction[ax]);
        emit->steps[ax] = steps[ax];
        emit->fraction[ax] = fraction[ax];
    }
}

static uint32_t duration_ns(struct emit *emit, float time_s) {
    double ns = (double)time_s * 1e9 + emit->time_ns;
    if (ns < 1.0)
        ns = 1.0;
    uint32_t whole = (uint32_t)ns;
    emit->time_ns = ns - (double)whole;
    return whole;
}

static uint8_t segment_flags(uint8_t motion_flags) {
    uint8_t flags = 0;
    flags |= (motion_flags & MOTION_FLAG_RAPID) != 0 ? SEGMENT_RAPID : 0;
    flags |= (motion_flags & MOTION_FLAG_PROBE) != 0 ? SEGMENT_PROBE : 0;
    flags |= (motion_flags & MOTION_FLAG_JOG) != 0 ? SEGMENT_JOG : 0;
    return flags;
}

/* What a segment says of itself besides its motion must be the same all through it. */
static bool is_other(const struct piece *a, const struct piece *b) {
    return a->flags != b->flags || a->note != b->note;
}

static float sample_s(const struct emit *emit, const struct piece *piece) {
    float left_mm = piece->length_mm - piece->tangent_mm - (float)emit->along_mm;
    float longest_mm = (emit->v_mm_s + piece->accel_mm_s2 * LINE_SAMPLE_S) * LINE_SAMPLE_S;
    return !emit->on_blend && left_mm > 1.5f * longest_mm ? LINE_SAMPLE_S : SAMPLE_S;
}

/* Travel for one sample, or to a stop, or to where another kind of motion begins. @return s */
static float travel_sample(struct emit *emit, const struct piece *piece) {
    struct path *path = &emit->plan->path;
    uint32_t tail = path->tail;
    float most_s = sample_s(emit, piece), time_s = 0.0f;
    while (time_s < most_s) {
        plan_time(emit->plan);
        float asked_s = most_s - time_s, took_s = travel(emit, asked_s);
        time_s += took_s;
        if (travel_ends(emit) || !emit->entered)
            break;
        if (path->tail != tail && is_other(piece, path_piece(path, path->tail)))
            break;
        if (!emit->on_blend && took_s < asked_s) { /* the acceleration changes here */
            if (time_s > LEAST_SAMPLE_S)
                break;
            most_s = SAMPLE_S;
        }
    }
    return time_s;
}

static void finish(struct emit *emit, const struct piece *last, struct segment *segment) {
    bool more = !plan_is_empty(emit->plan), asked = (last->flags & MOTION_FLAG_EXACT_STOP) != 0;
    bool may_end = asked || emit->flush || emit->hold || (last->flags & MOTION_FLAG_JOG) != 0;
    if (asked && !emit->entered)
        segment->flags |= SEGMENT_EXACT_STOP;
    if (!more || emit->hold)
        segment->flags |= SEGMENT_LAST;
    emit->ran_dry = travel_ends(emit) && !may_end;
}

static void emit_sample(struct emit *emit) {
    struct path *path = &emit->plan->path;
    const struct piece *piece = path_piece(path, path->tail);
    float v0 = emit->v_mm_s;
    int32_t steps[AXIS_COUNT] = {0};
    uint8_t fraction[AXIS_COUNT] = {0};
    float time_s = travel_sample(emit, piece);
    bool stop = !emit->entered;
    const struct piece *last = path_piece(path, stop ? path->tail - 1 : path->tail);
    struct segment segment = {.line = last->line, .flags = segment_flags(piece->flags)};
    if (stop)
        emit->v_mm_s = 0.0f;
    if (stop && (last->flags & PIECE_STOP) != 0)
        take_stop(emit, steps, fraction);
    else
        find_steps(emit, steps, fraction);
    set_axes(emit, &segment, steps, fraction);
    float v1 = emit->v_mm_s;
    segment.ramp = (int16_t)(v0 + v1 > 0.0f ? (v1 - v0) / (v0 + v1) * (float)SEGMENT_RAMP_ONE : 0.0f);
    if (v1 == 0.0f)
        finish(emit, last, &segment);
    segment.id = emit->next_id++;
    segment.duration_ns = duration_ns(emit, time_s);
    DEBUG(DEBUG_MOTION, "segment: line, ns", segment.line, segment.duration_ns);
    (void)segment_ring_push(emit->ring, RING_OWNER_PLANNER, &segment);
}

static void emit_dwell_slice(struct emit *emit) {
    uint64_t ns = emit->dwell_left_ns < MAX_DWELL_NS ? emit->dwell_left_ns : MAX_DWELL_NS;
    struct segment segment = {.duration_ns = (uint32_t)ns, .id = emit->next_id++, .flags = SEGMENT_DWELL};
    (void)segment_ring_push(emit->ring, RING_OWNER_PLANNER, &segment);
    emit->dwell_left_ns -= ns;
}

static bool has_next(const struct emit *emit) {
    return emit->dwell_left_ns > 0 || !travel_ends(emit);
}

bool emit_poll(struct emit *emit) {
    bool any = false;
    if (emit_is_idle(emit) || emit_is_held(emit) || !segment_ring_claim(emit->ring, RING_OWNER_PLANNER))
        return false;
    while (ring_free(&emit->ring->index, SEGMENT_RING_SIZE) > 0 &&
           segment_ring_queued_us(emit->ring) < EMIT_AHEAD_US && has_next(emit)) {
        if (!travel_ends(emit))
            emit_sample(emit);
        else
            emit_dwell_slice(emit);
        any = true;
    }
    return any;
}
