/* SPDX-License-Identifier: MIT */
#include "motion/planner.h"

#include "base/debug.h"
#include "base/minmax.h"
#include "motion/kinematics/kinematics.h"

#include <math.h>
#include <string.h>

/* |u1 - u0| below this is a straight line within float accuracy; above 2 minus it, a reversal. */
#define STRAIGHT_TURN 1e-3f

void plan_reset(struct plan *plan, const int32_t position_steps[AXIS_COUNT]) {
    plan->head = plan->tail = plan->queue_head = plan->queue_tail = 0;
    plan->potential = 0.0;
    plan->exit_known = false;
    plan->moving = false;
    memcpy(plan->position_steps, position_steps, sizeof plan->position_steps);
    kinematics_position_mm(position_steps, plan->limits.steps_per_mm, plan->position_mm);
}

/* Greatest v^2 (or acceleration) along a direction with every axis inside its own limit: min over axes of
 * limit/|u|. */
static float limit_along(const float unit[AXIS_COUNT], const float limit[AXIS_COUNT], unsigned count) {
    float least = 1e30f;
    for (unsigned ax = 0; ax < count; ax++) {
        float part = fabsf(unit[ax]);
        if (part * least > limit[ax])
            least = limit[ax] / part;
    }
    return least;
}

/* v^2 at the corner from direction a to direction b, taken as if it were rounded by a circle that stays
 * within the junction deviation d of the corner and within half of the shorter neighbour: with s = sin(half
 * the inner angle), r = d s/(1-s), and r = (l/2) s/sqrt(1-s^2);  v^2 = r * acceleration. The first is Grbl's
 * junction deviation (S. Jeon, 2011); the second lets the speed on a curve cut into short chords follow its
 * curvature instead of the angle of one joint. The acceleration points along b - a. */
static float corner_sq(const struct plan *plan, const float a[AXIS_COUNT], const float b[AXIS_COUNT],
                       float shorter_mm, float tolerance_mm) {
    float turn[AXIS_COUNT], turn_sq = 0.0f;
    for (unsigned ax = 0; ax < plan->limits.axis_count; ax++) {
        turn[ax] = b[ax] - a[ax];
        turn_sq += turn[ax] * turn[ax];
    }
    float cos_half_sq = 0.25f * turn_sq; /* sin^2 of half the turn = cos^2 of half the inner angle */
    if (turn_sq < STRAIGHT_TURN * STRAIGHT_TURN)
        return 1e30f;
    float sin_half = sqrtf(cos_half_sq < 1.0f ? 1.0f - cos_half_sq : 0.0f);
    float deviation_mm = most_f(plan->limits.junction_deviation_mm, tolerance_mm);
    float by_deviation = deviation_mm * sin_half * (1.0f + sin_half) / cos_half_sq;
    float cos_half = sqrtf(cos_half_sq);
    float by_length = 0.5f * shorter_mm * sin_half / cos_half;
    float radius_mm = by_deviation < by_length ? by_deviation : by_length;
    float norm = 0.5f / cos_half;
    for (unsigned ax = 0; ax < plan->limits.axis_count; ax++)
        turn[ax] *= norm;
    return radius_mm * limit_along(turn, plan->limits.accel_mm_s2, plan->limits.axis_count);
}

/* Path speed that was asked for. The feed counts along X Y Z; the other axes keep up (RS274/NGC 2.1.2.5). */
static float asked_speed(const struct motion_line *line, float linear_sq, float length_mm) {
    if (line->duration_s > 0.0f)
        return length_mm / line->duration_s;
    if ((line->flags & MOTION_FLAG_RAPID) != 0)
        return 1e12f; /* its square still is a float */
    return linear_sq > 0.0f ? line->feed_mm_s * length_mm / sqrtf(linear_sq) : line->feed_mm_s;
}

/* J + P of a block: what K of every block before it is measured against. */
static double candidate(struct plan *plan, uint32_t index) {
    const struct plan_block *block = plan_block(plan, index);
    return block->potential + (double)block->junction_sq;
}

/* Give a block its P, and let it drive out of the queue whatever it makes pointless. More than J never counts
 * in w: K is J then anyway, and the sum stays small. */
static void enqueue(struct plan *plan, uint32_t index) {
    struct plan_block *block = plan_block(plan, index);
    block->potential = plan->potential;
    plan->exit_known = false;
    while (plan->queue_head != plan->queue_tail &&
           candidate(plan, plan->queue[(plan->queue_head - 1) & (PLAN_SIZE - 1)]) >= candidate(plan, index))
        plan->queue_head--;
    plan->queue[plan->queue_head++ & (PLAN_SIZE - 1)] = index;
    plan->potential += (double)least_f(2.0f * block->accel_mm_s2 * block->length_mm, block->junction_sq);
}

/* Length that the block's time is reckoned by. Rounding can make one whole step of a far shorter programmed
 * move; half a step's length keeps that step from coming at once. */
static float timed_length_mm(const struct plan *plan, const struct plan_block *block, float length_mm) {
    if (block->dominant_steps > 1)
        return length_mm;
    for (unsigned ax = 0; ax < plan->limits.axis_count; ax++) {
        float half_mm = block->steps[ax] != 0 ? 0.5f / plan->limits.steps_per_mm[ax] : 0.0f;
        length_mm = half_mm > length_mm ? half_mm : length_mm;
    }
    return length_mm;
}

static uint32_t step_delta(const struct plan *plan, const struct motion_line *line,
                           int32_t target[AXIS_COUNT], int32_t steps[AXIS_COUNT]) {
    uint32_t dominant = 0;
    kinematics_target_steps(line->target_mm, plan->limits.steps_per_mm, plan->limits.axis_count, target);
    for (unsigned ax = 0; ax < plan->limits.axis_count; ax++) {
        steps[ax] = target[ax] - plan->position_steps[ax];
        uint32_t count = steps[ax] < 0 ? 0u - (uint32_t)steps[ax] : (uint32_t)steps[ax];
        dominant = count > dominant ? count : dominant;
    }
    return dominant;
}

/* Speeds of a block at the present overrides. Its predecessor's are set; `first`: it is entered at rest. */
static void set_caps(struct plan *plan, uint32_t index, bool first) {
    struct plan_block *block = plan_block(plan, index);
    bool rapid = (block->flags & MOTION_FLAG_RAPID) != 0;
    float override = rapid ? plan->rapid_override : plan->feed_override;
    float asked_sq = (rapid ? block->limit_sq : block->asked_sq) * override * override;
    block->nominal_sq = asked_sq < block->limit_sq ? asked_sq : block->limit_sq;
    block->junction_sq = first ? 0.0f : least_f(block->corner_sq, block->nominal_sq);
    if (!first)
        block->junction_sq = least_f(block->junction_sq, plan_block(plan, index - 1)->nominal_sq);
}

/* Direction of the move and lengths over X Y Z and over all axes. */
static float direction(const struct plan *plan, const struct motion_line *line, float unit[AXIS_COUNT],
                       float *linear_sq) {
    float length_sq = 0.0f;
    for (unsigned ax = 0; ax < plan->limits.axis_count; ax++) {
        unit[ax] = (float)(line->target_mm[ax] - plan->position_mm[ax]);
        length_sq += unit[ax] * unit[ax];
        if (ax <= AXIS_Z)
            *linear_sq = length_sq;
    }
    float length_mm = sqrtf(length_sq);
    float scale = length_mm > 0.0f ? 1.0f / length_mm : 0.0f;
    for (unsigned ax = 0; ax < plan->limits.axis_count; ax++)
        unit[ax] *= scale;
    return length_mm;
}

void plan_line(struct plan *plan, const struct motion_line *line) {
    struct plan_block *block = plan_block(plan, plan->head);
    int32_t target[AXIS_COUNT] = {0};
    memset(block->steps, 0, sizeof block->steps);
    block->dominant_steps = step_delta(plan, line, target, block->steps);
    if (block->dominant_steps == 0)
        return;

    float unit[AXIS_COUNT], linear_sq = 0.0f;
    float length_mm = direction(plan, line, unit, &linear_sq);
    block->length_mm = timed_length_mm(plan, block, length_mm);
    float limit = limit_along(unit, plan->limits.max_rate_mm_s, plan->limits.axis_count);
    float asked = asked_speed(line, linear_sq, block->length_mm);
    block->limit_sq = limit * limit;
    block->asked_sq = asked * asked;
    block->accel_mm_s2 = limit_along(unit, plan->limits.accel_mm_s2, plan->limits.axis_count);
    block->line = line->line;
    block->flags = line->flags;
    block->corner_sq = 0.0f;
    if (plan->moving) {
        const struct plan_block *last = plan_block(plan, plan->head - 1);
        block->corner_sq = corner_sq(plan, plan->last_unit, unit, least_f(last->length_mm, block->length_mm),
                                     line->tolerance_mm);
    }
    set_caps(plan, plan->head, !plan->moving);
    enqueue(plan, plan->head);
    memcpy(plan->position_steps, target, sizeof target);
    memcpy(plan->position_mm, line->target_mm, sizeof plan->position_mm);
    memcpy(plan->last_unit, unit, sizeof unit);
    plan->moving = (line->flags & MOTION_FLAG_EXACT_STOP) == 0;
    plan->head++;
    plan->blocks_total++;
    DEBUG(DEBUG_MOTION, "block: line, dominant steps", block->line, block->dominant_steps);
}

void plan_set_override(struct plan *plan, float feed, float rapid) {
    plan->feed_override = feed;
    plan->rapid_override = rapid;
    plan->queue_head = plan->queue_tail;
    for (uint32_t i = plan->tail; i != plan->head; i++) {
        set_caps(plan, i, plan_block(plan, i)->corner_sq == 0.0f);
        enqueue(plan, i);
    }
}

float plan_find_exit_sq(struct plan *plan) {
    uint32_t next = plan->tail + 1;
    if (plan_count(plan) <= 1)
        return 0.0f;
    while (plan->queue[plan->queue_tail & (PLAN_SIZE - 1)] - next > PLAN_SIZE) /* the block at tail is past */
        plan->queue_tail++;
    double least = candidate(plan, plan->queue[plan->queue_tail & (PLAN_SIZE - 1)]);
    least = least < plan->potential ? least : plan->potential;
    plan->exit_sq = (float)(least - plan_block(plan, next)->potential);
    plan->exit_known = true;
    return plan->exit_sq;
}

void plan_drop_tail(struct plan *plan) {
    plan->tail++;
    plan->exit_known = false;
    if (plan->tail == plan->head) {
        plan->potential = 0.0; /* no sum to keep: start small again */
        plan->queue_tail = plan->queue_head;
    }
}
