/* SPDX-License-Identifier: MIT */
#include "motion/motion.h"

#include "motion/kinematics/kinematics.h"

void motion_init(struct motion *motion, const struct motion_limits *limits) {
    const int32_t zero[AXIS_COUNT] = {0};
    motion->plan = (struct plan){.moves_total = 0};
    motion->newest_us = motion->oldest_us = 0;
    motion->waits = false;
    motion->queue.published = motion->queue.answered = 0;
    ahead_init(&motion->ahead, &motion->queue);
    emit_init(&motion->emit, &motion->plan, &motion->ahead);
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

/* What of the last piece may still be changed. While a batch is pending nothing may: should it be refused,
 * motion goes on as before. And nothing may while that end is the stop that the step interrupt may enter. */
static float slack_mm(struct motion *motion) {
    (void)ahead_take_answer(&motion->ahead);
    return motion->ahead.pending || motion->ahead.ends ? 0.0f : emit_slack_mm(&motion->emit);
}

bool motion_line(struct motion *motion, const struct motion_line *line, uint32_t now_us) {
    struct emit *emit = &motion->emit;
    if (!motion_has_room(motion) || (motion->plan.path.may_go_on && !ahead_open(&motion->ahead)))
        return false;
    ahead_close(&motion->ahead);
    if (plan_is_empty(&motion->plan))
        motion->oldest_us = now_us;
    motion->plan.path.slack_mm = slack_mm(motion);
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
    motion->plan.path.slack_mm = slack_mm(motion);
    plan_end(&motion->plan, true);
}

/* At rest, and more moves may still come that would give those here more look-ahead. */
static bool is_waiting(const struct motion *motion, bool paused, uint32_t now_us) {
    const struct emit *emit = &motion->emit;
    bool resting = emit->v_mm_s == 0.0f && !emit->entered && !motion->ahead.pending &&
                   ahead_left_us(&motion->ahead) < (int32_t)(AHEAD_NEAR_US / 2);
    return resting && !paused && !emit->flush && !plan_is_empty(&motion->plan) && motion_has_room(motion) &&
           now_us - motion->oldest_us < MOTION_START_MOST_US;
}

/* Near the end of what is planned, moves that wait for others become pieces. */
static void plan_more(struct motion *motion, bool paused) {
    struct plan *plan = &motion->plan;
    if (!plan_is_pending(plan) || ahead_left_us(&motion->ahead) >= (int32_t)(AHEAD_NEAR_US / 2) ||
        !emit_wants_more(&motion->emit) || !motion_has_room(motion))
        return;
    plan->path.slack_mm = slack_mm(motion);
    if (paused)
        plan_end(plan, true);
    else
        plan_close(plan);
}

bool motion_poll(struct motion *motion, uint32_t now_us) {
    struct emit *emit = &motion->emit;
    emit->now_us = now_us;
    bool paused = now_us - motion->newest_us >= MOTION_START_DELAY_US;
    emit->waits = motion->waits = is_waiting(motion, paused, now_us);
    if (!emit->waits)
        plan_more(motion, paused);
    if (motion->ahead.owner != AHEAD_PLANNER && (emit_is_idle(emit) || emit_is_held(emit)))
        return false;
    return emit_claim(emit) && ahead_poll(&motion->ahead);
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

void motion_reset(struct motion *motion, const int32_t position_steps[AXIS_COUNT]) {
    plan_reset(&motion->plan, position_steps);
    emit_reset(&motion->emit, position_steps);
    ahead_reset(&motion->ahead);
}
