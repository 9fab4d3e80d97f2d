/* SPDX-License-Identifier: MIT
 * How fast a path may be travelled: derived in docs/motion.md. [task]
 *
 * On a straight part y is v^2. On a blend with tangent d, directions u0 and u1 and du = u1 - u0,
 *
 *     q(t) = P + 2 d u0 t + d du t^2,   0 <= t <= 1,     y = 4 d^2 (dt/dtime)^2,
 *
 * y is v^2 at both ends. With y linear in t, of slope s = dy/dt, the acceleration is
 *
 *     q'' = (2 du y + (u0 + du t) s) / (4 d),
 *
 * linear in t: every axis keeps its limit A on a stretch if it does at both ends of it,
 *
 *     |2 du y + (u0 + du t) s| <= 4 d A   for each axis.
 *
 * So the limits on y and s are strips, and what is possible on half a blend (0 .. 1/2, 1/2 .. 1) is a small
 * linear program without square roots. */
#ifndef WIFICNC_MOTION_TIMING_H
#define WIFICNC_MOTION_TIMING_H

#include "motion/path.h"

/** A backward pass that is under way. */
struct timing_pass {
    bool runs;
    bool whole;       /* limits changed: it must not stop early */
    bool found;       /* what is settled */
    uint32_t head;    /* pieces that it sees */
    uint32_t at;      /* it has looked at this piece and those behind it */
    uint32_t settled; /* as timing.settled, when it is done */
    float next_cap;   /* limit of y on the piece at `at` */
};

/* A regular pass sees the pieces below a multiple of `step`, and leaves alone what is `reach` before that. So
 * what a piece has in the end does not depend on when moves came and when passes were made. */
struct timing {
    float feed_sq, rapid_sq; /* overrides, as factors of v^2: 1 = 100 % */
    uint32_t step, reach;    /* pieces; step: a power of two */
    uint32_t known;          /* pieces below this index were seen by the last pass */
    uint32_t settled;        /* whatever follows, enter_y of this piece, and all before, stays as it is */
    bool whole;              /* limits changed: what is known is not the greatest, or more than that */
    struct timing_pass pass;
    uint32_t unmet; /* times the forward pass could not follow within the axes' limits; a fault if not 0 */
};

/** Greatest v^2 on the straight part of a piece, feed, override and axis rates considered. */
static inline float timing_limit_sq(const struct timing *timing, const struct piece *piece) {
    bool rapid = (piece->flags & MOTION_FLAG_RAPID) != 0;
    float asked_sq = rapid ? piece->limit_sq * timing->rapid_sq : piece->asked_sq * timing->feed_sq;
    return min_f(asked_sq, piece->limit_sq);
}

/** What the next regular pass sees: the pieces below this index. */
static inline uint32_t timing_next_head(const struct timing *timing) {
    return (timing->known & ~(timing->step - 1u)) + timing->step;
}

/** From the newest piece, at whose blend the machine must be able to stop, back to the oldest that may have
 * to be travelled again: set enter_y, blend_y and middle_y to the greatest y from which all that follows can
 * be kept. Ends as soon as nothing changes, or where all is settled. The newest piece is that of the next
 * regular pass, if there are as many, or else the newest of all. What a pass that is under way has not come
 * to is as before: slower than it might be, or, with lower limits, too fast for those alone.
 *  @param most  pieces that it may look at now @return false: more are left, call again */
bool timing_backward(struct timing *timing, struct path *path, uint32_t most);

#endif
