/* SPDX-License-Identifier: MIT
 * Planned blocks -> segments, just in time. [task]
 *
 * The forward half of planning happens here, because only here the real speed is known. From the present
 * speed v0, the steps left in the block and the greatest exit speed that the look-ahead allows, the rest of
 * the block is
 *
 *      v ^      ____________ vp          vp^2 = min(nominal, (v0^2 + ve^2)/2 + a s)
 *        |    /              \           accelerate (vp^2 - v0^2)/2a, cruise, brake (vp^2 - ve^2)/2a
 *     v0 |  /                 \  ve
 *        +-------------------------> s   a slice of it becomes a segment, then the rest is reckoned anew,
 *                                        so later blocks, holds and overrides act within one segment.
 *
 * A slice ends on a step of the dominant axis. Where the other axes stand then follows from the whole block
 * in integers (32.32 fixed point), so nothing drifts and the block ends exactly. */
#ifndef WIFICNC_MOTION_EMIT_H
#define WIFICNC_MOTION_EMIT_H

#include "motion/planner.h"
#include "segment/ring.h"

/** How far emission runs ahead of prep. Nothing is decided earlier than it must be: what is not in the ring
 * can still be planned better, held, overridden or cancelled. */
#define EMIT_AHEAD_US 3000u

struct emit {
    struct plan *plan;
    struct segment_ring *ring;
    bool started;                   /* the block at tail has begun */
    float v_sq;                     /* (mm/s)^2 now, at the end of the last segment */
    float step_mm;                  /* path length of one dominant step */
    uint32_t done;                  /* dominant steps of the block already emitted */
    uint64_t slope_q32[AXIS_COUNT]; /* steps of each axis per dominant step, 32.32 */
    float waited_s;                 /* already waited before a very slow step */
    double time_ns;                 /* fraction of a nanosecond carried from segment to segment */
    bool flush;                     /* nothing follows: coming to rest is no starving */
    bool hold;                      /* slow down along the path and stand */
    bool ran_dry;                   /* came to rest for want of a next block */
    uint32_t starved;               /* times a next block came after that */
    uint16_t next_id;
    uint64_t dwell_left_ns;
};

void emit_init(struct emit *emit, struct plan *plan, struct segment_ring *ring);

/** Forget the block being emitted; speed 0. With plan_reset() after a stop. */
void emit_reset(struct emit *emit);

/** Put segments into the ring until EMIT_AHEAD_US is reached. @return true when any was put. Never blocks.
 */
bool emit_poll(struct emit *emit);

/** Let a dwell follow the last block. Only when emit_is_idle(). @param seconds  0 .. 1e6 */
void emit_dwell(struct emit *emit, double seconds);

/** Nothing planned and nothing half emitted. (The ring may still hold motion.) */
bool emit_is_idle(const struct emit *emit);

/** Standing still because of a hold: nothing more comes until it is lifted. (The ring may still hold motion.)
 */
bool emit_is_held(const struct emit *emit);

/** Path speed at the end of what was emitted, mm/s. */
float emit_speed_mm_s(const struct emit *emit);

#endif
