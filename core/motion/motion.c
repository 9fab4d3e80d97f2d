/* SPDX-License-Identifier: MIT */
#include "motion/motion.h"

#include "motion/kinematics/kinematics.h"

void motion_init(struct motion *motion, const struct motion_limits *limits) {
    const int32_t zero[AXIS_COUNT] = {0};
    motion->plan.blocks_total = 0;
    motion->plan.feed_override = motion->plan.rapid_override = 1.0f;
    motion->waits = false;
    motion->newest_us = 0;
    segment_ring_init(&motion->ring);
    emit_init(&motion->emit, &motion->plan, &motion->ring);
    motion_set_limits(motion, limits);
    plan_reset(&motion->plan, zero);
}

void motion_set_limits(struct motion *motion, const struct motion_limits *limits) {
    motion->plan.limits = *limits;
}

bool motion_in_range(const struct motion *motion, const double target_mm[AXIS_COUNT]) {
    return kinematics_in_range(target_mm, motion->plan.limits.steps_per_mm);
}

bool motion_line(struct motion *motion, const struct motion_line *line, uint32_t now_us) {
    if (plan_is_full(&motion->plan))
        return false;
    uint32_t blocks = motion->plan.blocks_total;
    plan_line(&motion->plan, line);
    if (motion->plan.blocks_total != blocks && motion->emit.ran_dry) {
        motion->emit.ran_dry = false;
        motion->emit.starved++;
    }
    motion->emit.flush = false;
    motion->newest_us = now_us;
    return true;
}

void motion_dwell(struct motion *motion, double seconds) {
    emit_dwell(&motion->emit, seconds);
}

void motion_flush(struct motion *motion) {
    motion->emit.flush = true;
    motion->emit.ran_dry = false;
}

bool motion_poll(struct motion *motion, uint32_t now_us) {
    const struct emit *emit = &motion->emit;
    bool resting = emit->v_sq == 0.0f && !emit->started && segment_ring_peek(&motion->ring) == 0;
    motion->waits = resting && plan_count(&motion->plan) > 0 && !plan_is_full(&motion->plan) &&
                    !emit->flush && now_us - motion->newest_us < MOTION_START_DELAY_US;
    return !motion->waits && emit_poll(&motion->emit);
}

void motion_hold(struct motion *motion) {
    motion->emit.hold = true;
}

void motion_resume(struct motion *motion) {
    motion->emit.hold = false;
}

bool motion_is_held(const struct motion *motion) {
    return emit_is_held(&motion->emit);
}

void motion_set_override(struct motion *motion, float feed, float rapid) {
    plan_set_override(&motion->plan, feed, rapid);
}

bool motion_is_planned_out(const struct motion *motion) {
    return emit_is_idle(&motion->emit);
}

void motion_reset(struct motion *motion, const int32_t position_steps[AXIS_COUNT]) {
    plan_reset(&motion->plan, position_steps);
    emit_reset(&motion->emit);
    motion->ring.index.tail = motion->ring.index.head;
    motion->ring.popped_us = motion->ring.pushed_us;
}
