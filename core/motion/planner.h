/* SPDX-License-Identifier: MIT
 * The look-ahead planner: straight moves -> blocks, and how fast each may be entered. [task]
 *
 * Speeds are kept as squares, v^2 in (mm/s)^2, because braking over a distance s changes v^2 by 2 a s.
 *
 * The greatest v^2 at the start of block i, K(i), is what its corner allows, J(i), or what braking over the
 * block still brings down to K(i+1):   K(i) = min(J(i), K(i+1) + w(i)),   w = 2 a L,   0 at the end of the
 * newest block. Write P for the running sum of w. Then
 *
 *     K(i) = min over j >= i of (J(j) + P(j)) - P(i),   with J = 0 at the end:
 *
 * a minimum over a sliding window, which a queue of candidates in rising order gives in O(1) per block. So
 * there is no backward pass, and looking ahead 64 blocks costs as much as looking ahead one. The forward
 * half, what can be reached by accelerating, is the emitter's (motion/emit.h), which knows the real speed. */
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
    uint8_t axis_count;              /* axes that exist: X .. */
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
    float tolerance_mm;           /* >= 0: a corner of its own, if larger than $11 (G64 P) */
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
    float junction_sq;       /* J: the corner and both nominal speeds */
    double potential;        /* P at the start of the block, (mm/s)^2 */
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
    double potential;                    /* P at the end of the newest block */
    uint32_t queue_head, queue_tail;     /* of queue; wrap at 2^32 */
    uint32_t queue[PLAN_SIZE];           /* indices of blocks with rising J + P, oldest first */
    float exit_sq;                       /* what plan_exit_sq() found, while exit_known */
    bool exit_known;
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

/** Append a move; there is room. A move shorter than half a step on every axis makes no block; its target
 * counts for the next one. */
void plan_line(struct plan *plan, const struct motion_line *line);

/** New overrides for all blocks, also the one being emitted. @param feed 0.1 .. 2, @param rapid 0.25 .. 1 */
void plan_set_override(struct plan *plan, float feed, float rapid);

/** Behind plan_exit_sq(): find it anew. */
float plan_find_exit_sq(struct plan *plan);

/** Greatest v^2 at the end of the block at tail: what its successor may be entered with, or 0. */
static inline float plan_exit_sq(struct plan *plan) {
    return plan->exit_known ? plan->exit_sq : plan_find_exit_sq(plan);
}

/** The block at tail has been emitted. */
void plan_drop_tail(struct plan *plan);

#endif
