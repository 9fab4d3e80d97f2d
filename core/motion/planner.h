/* SPDX-License-Identifier: MIT
 * The look-ahead planner: straight moves -> blocks that know how fast they may be entered. [task]
 *
 * Speeds are kept as squares, v^2 in (mm/s)^2, because braking over a distance s changes v^2 by 2 a s.
 *
 * Each block holds one number that looks ahead, `entry_sq`: the greatest v^2 at its start from which
 * everything behind it, up to a stop at the end of the last known block, can still be done. Adding a block
 * can only raise these numbers, so the backward pass stops at the first one that does not change: O(1) per
 * block in the usual case. What can be reached by accelerating is the emitter's business (motion/emit.h),
 * which knows the real speed; no forward pass.
 *
 *   ring:  tail = block being emitted ... head = newest;  entry_sq(i) = min(junction_sq(i), entry_sq(i+1) + 2
 * a(i) L(i)) */
#ifndef WIFICNC_MOTION_PLANNER_H
#define WIFICNC_MOTION_PLANNER_H

#include "base/axis.h"
#include "config.h"

#include <stdbool.h>
#include <stdint.h>

/** Limits of the machine, in the planner's units. */
struct motion_limits {
    float steps_per_mm[AXIS_COUNT];  /* > 0; steps per degree on rotary axes */
    float max_rate_mm_s[AXIS_COUNT]; /* > 0; already within the board's step rate */
    float accel_mm_s2[AXIS_COUNT];   /* > 0 */
    float junction_deviation_mm;     /* >= 0, $11 */
    axis_mask_t axes;                /* axes that exist */
};

/** How a move is to be made. */
enum motion_flags {
    MOTION_FLAG_RAPID = 0x01,      /* as fast as the axes allow */
    MOTION_FLAG_EXACT_STOP = 0x02, /* rest at the end (G61, G61.1, probing) */
    MOTION_FLAG_PROBE = 0x04,
    MOTION_FLAG_JOG = 0x08,
};

/** One straight move. */
struct motion_line {
    double target_mm[AXIS_COUNT]; /* machine coordinates, kinematics_in_range() */
    float feed_mm_s;              /* > 0 unless rapid; along X Y Z, or degrees/s when only rotary axes move */
    float duration_s;             /* > 0: take this long instead (G93) */
    uint32_t line;                /* source line */
    uint8_t flags;                /* enum motion_flags */
};

/** A planned block. */
struct plan_block {
    int32_t steps[AXIS_COUNT];
    uint32_t dominant_steps; /* of the axis with most steps, > 0 */
    float length_mm;         /* over all axes */
    float accel_mm_s2;       /* along the block: every axis inside its limit */
    float asked_sq;          /* (mm/s)^2 along the block: feed at 100 %, or huge for a rapid */
    float limit_sq;          /* (mm/s)^2 along the block that the axis rates allow */
    float nominal_sq;        /* min(asked with override, limit) */
    float corner_sq;         /* what the corner before the block allows */
    float junction_sq;       /* upper limit of entry_sq: the corner and both nominal speeds */
    float entry_sq;          /* see above */
    uint32_t line;
    uint8_t flags;
};

struct plan {
    struct motion_limits limits;
    float feed_override, rapid_override; /* 1 = 100 % */
    uint32_t head, tail;                 /* single context: plain indices, wrap at 2^32 */
    int32_t position_steps[AXIS_COUNT];  /* end of the newest block */
    double position_mm[AXIS_COUNT];      /* programmed end of the newest move, unrounded */
    float last_unit[AXIS_COUNT];         /* direction of the newest block */
    bool moving;                         /* the next block may be entered at speed */
    uint32_t blocks_total;
    struct plan_block blocks[PLAN_SIZE];
};

/** Empty, at this position. */
void plan_reset(struct plan *plan, const int32_t position_steps[AXIS_COUNT]);

static inline uint32_t plan_count(const struct plan *plan) {
    return plan->head - plan->tail;
}
static inline bool plan_is_full(const struct plan *plan) {
    return plan_count(plan) == PLAN_SIZE;
}

static inline struct plan_block *plan_block(struct plan *plan, uint32_t index) {
    return &plan->blocks[index & (PLAN_SIZE - 1)];
}

/** Append a move. A move shorter than half a step on every axis makes no block; its target counts for the
 * next one.
 *  @return false: the ring is full, nothing was changed. */
bool plan_line(struct plan *plan, const struct motion_line *line);

/** New overrides for all blocks, also the one being emitted. @param feed 0.1 .. 2, @param rapid 0.25 .. 1 */
void plan_set_override(struct plan *plan, float feed, float rapid);

/** Greatest v^2 at the end of the block at tail: the entry of its successor, or 0. */
float plan_exit_sq(const struct plan *plan);

/** The block at tail has been emitted. */
void plan_drop_tail(struct plan *plan);

#endif
