/* SPDX-License-Identifier: MIT */
#include "motion/motion.h"

#include "motion/kinematics/kinematics.h"

void motion_init(struct motion *motion, const struct motion_limits *limits) {
    const int32_t zero[AXIS_COUNT] = {0};
    motion->plan = (struct plan){.moves_total = 0};
    motion->newest_us = motion->oldest_us = 0;
    motion->waits = false;
    segment_ring_init(&motion->ring);
    emit_init(&motion->emit, &motion->plan, &motion->ring);
    motion_set_limits(motion, limits);
    plan_set_override(&motion->plan, 1.0f, 1.0f);
    motion_reset(motion, zero);
}

void motion_set_limits(struct motion *motion, const struct motion_limits *limits) {
    plan_set_limits(&motion->plan, limits);
    emit_set_filter(&motion->emit, motion->plan.filter_s);
}

bool motion_in_range(const struct motion *motion, const double target_mm[AXIS_COUNT]) {
    return kinematics_in_range(target_mm, motion->plan.limits.steps_per_mm);
}

bool motion_line(struct motion *motion, const struct motion_line *line, uint32_t now_us) {
    struct emit *emit = &motion->emit;
    if (!motion_has_room(motion))
        return false;
    if (plan_is_empty(&motion->plan))
        motion->oldest_us = now_us;
    motion->plan.path.slack_mm = emit_slack_mm(emit);
    plan_line(&motion->plan, line);
    emit->starved += emit->ran_dry;
    emit->ran_dry = emit->flush = false;
    motion->newest_us = now_us;
    return true;
}

void motion_dwell(struct motion *motion, double seconds) {
    emit_dwell(&motion->emit, seconds);
}

void motion_gear(struct motion *motion, const struct gear_path *path) {
    emit_gear(&motion->emit, path);
}

void motion_flush(struct motion *motion) {
    motion->emit.flush = true;
    motion->emit.ran_dry = false;
    motion->plan.path.slack_mm = emit_slack_mm(&motion->emit);
    plan_end(&motion->plan, true);
}

/* At rest, and more moves may still come that would give those here more look-ahead. */
static bool is_waiting(const struct motion *motion, bool paused, uint32_t now_us) {
    const struct emit *emit = &motion->emit;
    bool resting = emit->v_mm_s == 0.0f && !emit->entered && segment_ring_peek(&motion->ring) == 0;
    return resting && !paused && !emit->flush && !plan_is_empty(&motion->plan) && motion_has_room(motion) &&
           now_us - motion->oldest_us < MOTION_START_MOST_US;
}

bool motion_poll(struct motion *motion, uint32_t now_us) {
    struct plan *plan = &motion->plan;
    motion->emit.now_us = now_us;
    bool paused = now_us - motion->newest_us >= MOTION_START_DELAY_US;
    motion->waits = is_waiting(motion, paused, now_us);
    if (motion->waits)
        return false;
    if (plan_is_pending(plan) && emit_wants_more(&motion->emit) && motion_has_room(motion)) {
        plan->path.slack_mm = emit_slack_mm(&motion->emit);
        if (paused)
            plan_end(plan, true);
        else
            plan_close(plan);
    }
    return emit_poll(&motion->emit);
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
    motion->emit.late = true;
}

bool motion_is_planned_out(const struct motion *motion) {
    return emit_is_idle(&motion->emit);
}

void motion_reset(struct motion *motion, const int32_t position_steps[AXIS_COUNT]) {
    plan_reset(&motion->plan, position_steps);
    emit_reset(&motion->emit, position_steps);
    motion->ring.index.tail = motion->ring.index.head;
    motion->ring.popped_us = motion->ring.pushed_us;
}
