/* SPDX-License-Identifier: MIT */
#include "motion/emit.h"

#include "base/debug.h"
#include "base/minmax.h"

#include <math.h>
#include <string.h>

#define SLICE_S      0.003f      /* aim for the duration of a segment */
#define MAX_DWELL_NS 1000000000u /* of one dwell segment */
#define MAX_SLICE_S  4.0f        /* a single step slower than this is preceded by waits of WAIT_NS */
#define WAIT_NS      1000000000u

/* The rest of a block, as speeds and lengths of its three parts. */
struct profile {
    float accel;                            /* mm/s^2 */
    float v0_sq, peak_sq, exit_sq;          /* (mm/s)^2 */
    float accelerate_mm, brake_from_mm, mm; /* ends of the parts, from here */
};

void emit_init(struct emit *emit, struct plan *plan, struct segment_ring *ring) {
    *emit = (struct emit){.plan = plan, .ring = ring};
}

void emit_reset(struct emit *emit) {
    emit->started = emit->flush = emit->hold = emit->ran_dry = false;
    emit->v_sq = emit->waited_s = 0.0f;
    emit->dwell_left_ns = 0;
}

bool emit_is_idle(const struct emit *emit) {
    return plan_count(emit->plan) == 0 && emit->dwell_left_ns == 0;
}

float emit_speed_mm_s(const struct emit *emit) {
    return sqrtf(emit->v_sq);
}

void emit_dwell(struct emit *emit, double seconds) {
    emit->dwell_left_ns = (uint64_t)(seconds * 1e9 + 0.5);
}

static void begin_block(struct emit *emit, const struct plan_block *block) {
    emit->started = true;
    emit->done = 0;
    emit->step_mm = block->length_mm / (float)block->dominant_steps;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        uint64_t count = (uint32_t)(block->steps[ax] < 0 ? -block->steps[ax] : block->steps[ax]);
        emit->slope_q32[ax] = count == block->dominant_steps
                                  ? (uint64_t)1 << 32
                                  : ((count << 32) + block->dominant_steps / 2) / block->dominant_steps;
    }
}

/* From v0 down to target_sq as hard as the block allows, ending on a step; the end of the block may come
 * first. */
static struct profile slow_down(const struct emit *emit, const struct plan_block *block, float target_sq,
                                uint32_t *steps) {
    struct profile p = {.accel = block->accel_mm_s2, .v0_sq = emit->v_sq, .peak_sq = emit->v_sq};
    uint32_t left = block->dominant_steps - emit->done;
    float needed = ceilf((p.v0_sq - target_sq) / (2.0f * p.accel * emit->step_mm));
    *steps = needed < (float)left ? (uint32_t)needed : left;
    *steps = *steps > 0 ? *steps : 1;
    p.mm = (float)*steps * emit->step_mm;
    float reach_sq = p.v0_sq - 2.0f * p.accel * p.mm;
    p.exit_sq = reach_sq > target_sq ? reach_sq : target_sq;
    return p;
}

/* The rest of the block, or as much of it as is left before a hold's stop; *steps is its length. */
static struct profile rest_of_block(const struct emit *emit, const struct plan_block *block,
                                    uint32_t *steps) {
    struct profile p = {.accel = block->accel_mm_s2, .v0_sq = emit->v_sq};
    float two_a = 2.0f * p.accel;
    if (emit->hold)
        return slow_down(emit, block, 0.0f, steps);
    if (p.v0_sq > block->nominal_sq * 1.0001f)
        return slow_down(emit, block, block->nominal_sq, steps);
    *steps = block->dominant_steps - emit->done;
    p.mm = (float)*steps * emit->step_mm;
    float reach_sq = p.v0_sq + two_a * p.mm;
    float brake_sq = p.v0_sq * 0.999f - two_a * p.mm; /* float noise must not keep us from resting */
    p.exit_sq = least_f(plan_exit_sq(emit->plan), reach_sq);
    p.exit_sq = most_f(p.exit_sq, brake_sq);
    p.peak_sq = least_f(block->nominal_sq, 0.5f * (p.v0_sq + p.exit_sq) + p.accel * p.mm);
    p.peak_sq = most_f(p.peak_sq, p.v0_sq);
    p.accelerate_mm = (p.peak_sq - p.v0_sq) / two_a;
    p.brake_from_mm = p.mm - most_f(p.peak_sq - p.exit_sq, 0.0f) / two_a;
    p.brake_from_mm = most_f(p.brake_from_mm, p.accelerate_mm);
    return p;
}

/* v^2 at x, and the time from here to x. Each part takes length / mean speed. */
static float profile_at(const struct profile *p, float x, float *v_sq) {
    float v0 = sqrtf(p->v0_sq);
    if (x <= p->accelerate_mm) {
        *v_sq = p->v0_sq + 2.0f * p->accel * x;
        return 2.0f * x / (v0 + sqrtf(*v_sq));
    }
    float peak = sqrtf(p->peak_sq);
    float time_s = p->accelerate_mm > 0.0f ? 2.0f * p->accelerate_mm / (v0 + peak) : 0.0f;
    *v_sq = p->peak_sq;
    if (x <= p->brake_from_mm)
        return time_s + (x - p->accelerate_mm) / peak;
    time_s += p->brake_from_mm > p->accelerate_mm ? (p->brake_from_mm - p->accelerate_mm) / peak : 0.0f;
    float braking = x - p->brake_from_mm;
    *v_sq = p->peak_sq - (p->peak_sq - p->exit_sq) * (braking / (p->mm - p->brake_from_mm));
    if (*v_sq < 0.0f)
        *v_sq = 0.0f;
    return time_s + 2.0f * braking / (peak + sqrtf(*v_sq));
}

/* Dominant steps of the next slice: one part of the profile, or SLICE_S of it, to the nearest step. */
static uint32_t slice_steps(const struct emit *emit, const struct profile *p, uint32_t left) {
    float v0 = sqrtf(p->v0_sq);
    float per_mm = 1.0f / emit->step_mm;
    float part_mm = p->mm, accel = -p->accel;
    if (p->accelerate_mm * per_mm >= 0.5f) {
        part_mm = p->accelerate_mm;
        accel = p->accel;
    } else if (p->brake_from_mm * per_mm >= 0.5f) {
        part_mm = p->brake_from_mm;
        accel = 0.0f;
    }
    float slice_mm = (v0 + 0.5f * accel * SLICE_S) * SLICE_S;
    if (accel < 0.0f && v0 < p->accel * SLICE_S)
        slice_mm = part_mm;
    float steps = (slice_mm * 1.5f < part_mm ? slice_mm : part_mm) * per_mm + 0.5f;
    uint32_t count = steps < (float)SEGMENT_MAX_STEPS ? (uint32_t)steps : SEGMENT_MAX_STEPS;
    count = count > 0 ? count : 1;
    return count < left ? count : left;
}

/* Steps and phases of all axes from dominant step `done` to `to` of the block. */
static void slice_axes(const struct emit *emit, const struct plan_block *block, uint32_t to,
                       struct segment *segment) {
    const uint64_t half_q32 = (uint64_t)1 << 31;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        uint64_t from_q32 = emit->done * emit->slope_q32[ax] + half_q32;
        uint64_t to_q32 = to * emit->slope_q32[ax] + half_q32;
        int32_t steps = (int32_t)((to_q32 >> 32) - (from_q32 >> 32));
        segment->phase[ax] = (uint8_t)(from_q32 >> 24);
        segment->phase_end[ax] = (uint8_t)(to_q32 >> 24);
        segment->steps[ax] = block->steps[ax] < 0 ? -steps : steps;
    }
}

static void finish_block(struct emit *emit, const struct plan_block *block, struct segment *segment) {
    bool stop = emit->v_sq == 0.0f;
    emit->started = false;
    if ((block->flags & MOTION_FLAG_EXACT_STOP) != 0)
        segment->flags |= SEGMENT_EXACT_STOP;
    bool last = plan_count(emit->plan) == 1;
    if (stop && last)
        segment->flags |= SEGMENT_LAST;
    emit->ran_dry =
        stop && last && !emit->flush && !emit->hold && (block->flags & MOTION_FLAG_EXACT_STOP) == 0;
    plan_drop_tail(emit->plan);
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

static void push_wait(struct emit *emit, uint32_t ns, uint8_t flags, uint32_t line) {
    struct segment segment = {.duration_ns = ns, .id = emit->next_id++, .flags = flags, .line = line};
    (void)segment_ring_push(emit->ring, RING_OWNER_PLANNER, &segment);
}

/* The next slice of the block at tail; the ring has a free slot. */
static void emit_slice(struct emit *emit) {
    const struct plan_block *block = plan_block(emit->plan, emit->plan->tail);
    if (!emit->started)
        begin_block(emit, block);
    uint32_t left;
    struct profile profile = rest_of_block(emit, block, &left);
    uint32_t count = slice_steps(emit, &profile, left);
    struct segment segment = {.line = block->line, .flags = segment_flags(block->flags)};
    float v_sq, x = count == left ? profile.mm : (float)count * emit->step_mm;
    float time_s = profile_at(&profile, x, &v_sq) - emit->waited_s;
    if (time_s > MAX_SLICE_S) {
        emit->waited_s += (float)WAIT_NS * 1e-9f;
        push_wait(emit, WAIT_NS, segment.flags, block->line);
        return;
    }
    emit->waited_s = 0.0f;
    if (count == left)
        v_sq = profile.exit_sq;
    float v0 = sqrtf(emit->v_sq), v1 = sqrtf(v_sq);
    segment.id = emit->next_id++;
    segment.ramp = (int16_t)(v0 + v1 > 0.0f ? (v1 - v0) / (v0 + v1) * (float)SEGMENT_RAMP_ONE : 0.0f);
    slice_axes(emit, block, emit->done + count, &segment);
    emit->done += count;
    emit->v_sq = v_sq;
    if (emit->done == block->dominant_steps)
        finish_block(emit, block, &segment);
    else if (v_sq == 0.0f)
        segment.flags |= SEGMENT_LAST;
    segment.duration_ns = duration_ns(emit, time_s);
    DEBUG(DEBUG_MOTION, "segment: dominant steps, ns", count, segment.duration_ns);
    (void)segment_ring_push(emit->ring, RING_OWNER_PLANNER, &segment);
}

static void emit_dwell_slice(struct emit *emit) {
    uint64_t ns = emit->dwell_left_ns < MAX_DWELL_NS ? emit->dwell_left_ns : MAX_DWELL_NS;
    push_wait(emit, (uint32_t)ns, SEGMENT_DWELL, 0);
    emit->dwell_left_ns -= ns;
}

bool emit_is_held(const struct emit *emit) {
    return emit->hold && emit->v_sq == 0.0f;
}

bool emit_poll(struct emit *emit) {
    bool any = false;
    if (emit_is_idle(emit) || emit_is_held(emit) || !segment_ring_claim(emit->ring, RING_OWNER_PLANNER))
        return false;
    while (ring_free(&emit->ring->index, SEGMENT_RING_SIZE) > 0 &&
           segment_ring_queued_us(emit->ring) < EMIT_AHEAD_US && !emit_is_held(emit) && !emit_is_idle(emit)) {
        if (plan_count(emit->plan) > 0)
            emit_slice(emit);
        else
            emit_dwell_slice(emit);
        any = true;
    }
    return any;
}
