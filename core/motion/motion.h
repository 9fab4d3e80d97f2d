/* SPDX-License-Identifier: MIT
 * The motion room's door: moves in, segments out. [task]
 *
 *   motion_line() -> planner (smooth path, look-ahead) -> emit (just in time) -> segment queue */
#ifndef WIFICNC_MOTION_MOTION_H
#define WIFICNC_MOTION_MOTION_H

#include "motion/emit.h"
#include "motion/planner.h"
#include "segment/ahead.h"

/** Wait this long for more moves before starting from rest, and before the newest move is taken for the last
 * one, so that short moves have look-ahead. */
#define MOTION_START_DELAY_US 10000u

/** ... but no longer than this, however steadily more moves come. */
#define MOTION_START_MAX_US 50000u

struct motion {
    struct plan plan;
    struct emit emit;
    struct segment_queue queue; /* to the motion side */
    struct ahead ahead;         /* of the planner or of a network host */
    uint32_t newest_us;         /* when the newest move came */
    uint32_t oldest_us;         /* when the first move came to an empty plan */
    bool waits; /* at rest, with moves that wait for more: ask again within MOTION_START_DELAY_US */
    bool works; /* poll again immediately: the plan is being timed, or a batch is half made */
};

/** At rest at step position 0. @param look_ahead  pieces of path, 32 .. PLAN_SIZE @param laser_marks  changes
 * of S in it, 256 .. POWER_MARKS */
void motion_init(struct motion *motion, const struct motion_limits *limits, uint32_t look_ahead,
                 uint32_t laser_marks);

/** Change the limits. Only when motion_is_planned_out(). */
void motion_set_limits(struct motion *motion, const struct motion_limits *limits);

/** True when the target's steps fit the counters; a move beyond is an error, not a wrap. */
bool motion_in_range(const struct motion *motion, const double target_mm[AXIS_COUNT]);

/** Whether a move can still be joined to the last one at speed is known when the motion side has answered. */
static inline bool motion_end_is_pending(const struct motion *motion) {
    return motion->plan.path.may_go_on && ahead_is_pending(&motion->ahead);
}

/** Room for one more move. */
static inline bool motion_has_room(const struct motion *motion) {
    return plan_free(&motion->plan) != 0 && power_has_room(&motion->plan.power) &&
           !motion_end_is_pending(motion);
}

/** Append a straight move. @return false: no room in the look-ahead, or the end of the last move must be
 * taken back first; try again later, after motion_poll(). Nothing was changed. */
bool motion_line(struct motion *motion, const struct motion_line *line, uint32_t now_us);

struct joints;

/** As motion_line(), for the tool: target_mm is its machine coordinates, and its way may be several lines of
 * the motors. @return false: no room for all of it now; call again with the same line */
bool motion_tool_line(struct motion *motion, struct joints *joints, const struct motion_line *line,
                      uint32_t now_us);

/** Stand still for this long after the last move. Only when motion_is_planned_out(). */
void motion_dwell(struct motion *motion, double seconds);

/** Follow the spindle. Only when motion_is_planned_out(); see emit_gear(). */
void motion_gear(struct motion *motion, const struct gear_path *path);

/** Nothing follows for now: do not wait for more look-ahead. Cleared by the next motion_line(). */
void motion_flush(struct motion *motion);

/** The same, and whatever follows begins at rest. */
void motion_end(struct motion *motion);

/** Publish motion. @return true when anything was. Never blocks. */
bool motion_poll(struct motion *motion, uint32_t now_us);

/** All moves and dwells are published or done. */
bool motion_is_planned_out(const struct motion *motion);

/** Feed hold: slow down along the path as hard as the limits allow, and stand. Acts a few
 * ms ahead of the pins. */
void motion_hold(struct motion *motion);

/** Lift a hold; also one that has not yet come to rest. */
void motion_resume(struct motion *motion);

/** A hold has ended: what is published is the last. */
bool motion_is_held(const struct motion *motion);

/** Overrides: 1 = 100 %. @param feed 0.1 .. 2; @param rapid 0.25 .. 1 */
void motion_set_override(struct motion *motion, float feed, float rapid);

/** Held and at rest: all that is planned moves by so many steps of the joints; the axes are brought there by
 * others. */
void motion_shift(struct motion *motion, const int32_t steps[AXIS_COUNT]);

/** What is planned and where it is held lies between these two, but for rounded corners, joints in mm. */
void motion_bounds(const struct motion *motion, double low_mm[AXIS_COUNT], double high_mm[AXIS_COUNT]);

/** Drop everything not yet in steps and stand at this position. The motion side is halted, and prep was
 * reset. */
void motion_reset(struct motion *motion, const int32_t position_steps[AXIS_COUNT]);

#endif
