/* SPDX-License-Identifier: MIT
 * The look-ahead planner: straight moves -> pieces of a smooth path, and how fast each may be travelled.
 * [task]
 *
 *   plan_line() -> reduce (motion/reduce.h) -> path (motion/path.h) -> timing (motion/timing.h)
 *
 * Limits hold because the path is really round where it is passed at speed, within the tolerance, and because
 * the timing keeps every axis inside its limits at every instant. docs/motion.md derives all of it. The
 * forward half of the timing, what can be reached by accelerating, is the emitter's (motion/emit.h), which
 * knows the real speed. */
#ifndef WIFICNC_MOTION_PLANNER_H
#define WIFICNC_MOTION_PLANNER_H

#include "motion/move.h"
#include "motion/path.h"
#include "motion/power.h"
#include "motion/reduce.h"
#include "motion/shaper.h"
#include "motion/timing.h"

/** Most pieces that one chord can become. */
#define PLAN_BURST 3u

/** A backward pass looks at many pieces. A regular one sees a multiple of 1/PLAN_FRESH of the look-ahead
 * (less, if that is no power of two). Where motion needs one that sees less, it waits until 1/PLAN_FRESH of
 * the pieces ahead is new, when there are PLAN_MANY. */
#define PLAN_FRESH 8u
#define PLAN_MANY  16u

struct plan {
    uint32_t look_ahead; /* pieces that it may hold: PLAN_SIZE or less */
    struct motion_limits limits;
    struct shaper shaper;           /* of all motion but for: */
    struct shaper unshaped;         /* probing, homing, threads: jerk alone is limited */
    float shaped_mm;                /* how far shaping takes the axes off the path at most */
    float curve_s;                  /* longest segment of a curve */
    float merge_mm;                 /* longest chord of several moves */
    double position_mm[AXIS_COUNT]; /* programmed end of the newest move, unrounded */
    struct motion_line newest;      /* the move that the open chord is made of */
    uint32_t first_line; /* of the moves in the open chord: reports name it until merge_mm are made */
    float tolerance_mm;  /* of that move */
    struct reduce reduce;
    struct path path;
    struct timing timing;
    struct power power;
    uint32_t moves_total;
};

/** Pieces that still fit, with room for everything that one more move can make. */
static inline uint32_t plan_free(const struct plan *plan) {
    const struct path *path = &plan->path;
    uint32_t chords = (plan->reduce.open ? 2u : 1u) + (path->waits ? 1u : 0u);
    uint32_t used = path->head - path->kept + path->newest - path->blended + PLAN_BURST * chords;
    if (used >= plan->look_ahead || path->stop_head - path->stop_kept >= PATH_STOPS - 1)
        return 0;
    return plan->look_ahead - used;
}

/** Moves that the look-ahead holds at least, when no points are left out. */
static inline uint32_t plan_moves(const struct plan *plan) {
    return plan->look_ahead - PLAN_BURST;
}

/** Moves not yet made into pieces. */
static inline bool plan_is_pending(const struct plan *plan) {
    return plan->reduce.open || path_pending(&plan->path) != 0;
}

static inline bool plan_is_empty(const struct plan *plan) {
    return path_count(&plan->path) == 0 && !plan_is_pending(plan);
}

/** All that has come so far is pieces, and they end at rest. */
static inline bool plan_has_ended(const struct plan *plan) {
    return !plan_is_pending(plan) && plan->path.knots[plan->path.newest & (KNOT_RING - 1)].stop;
}

/** Later moves change nothing of the next so many pieces, however early or late they come. */
static inline bool plan_is_final(const struct plan *plan, uint32_t pieces) {
    return (int32_t)(plan->timing.settled - plan->path.tail - pieces) > 0;
}

/** There are so many pieces ahead that a sender which keeps up will bring the rest in time. */
static inline bool plan_is_long(const struct plan *plan) {
    return path_count(&plan->path) * 2 >= plan->timing.reach;
}

/** A backward pass is under way, or one is to be made whatever motion needs: all limits are new, a regular
 * one, or the last one before a rest. */
static inline bool plan_has_pass(const struct plan *plan) {
    const struct timing *timing = &plan->timing;
    const struct path *path = &plan->path;
    if (timing->whole || path->changed || timing->pass.runs)
        return true;
    uint32_t differs = path->head ^ timing->known;
    return differs >= timing->step || (differs != 0 && plan_has_ended(plan));
}

/** The limits on y are those of all that is planned, or of all but its newest 1/PLAN_FRESH, or the next
 * `margin` pieces do not need it. */
static inline bool plan_is_timed(const struct plan *plan, uint32_t margin) {
    const struct timing *timing = &plan->timing;
    const struct path *path = &plan->path;
    if (timing->whole || path->changed || timing->pass.runs)
        return false;
    uint32_t fresh = path->head - timing->known, count = path_count(path);
    bool much = fresh * PLAN_FRESH > count || (fresh > 0 && count < PLAN_MANY);
    return !much || plan_is_final(plan, margin);
}

/** A backward pass: the next regular one, or one of what there is.
 * @param most  pieces that may be looked at now @return false: more are left, call again */
static inline bool plan_time(struct plan *plan, uint32_t most) {
    plan->timing.whole = plan->timing.whole || plan->path.changed;
    plan->path.changed = false;
    return timing_backward(&plan->timing, &plan->path, most);
}

#endif
