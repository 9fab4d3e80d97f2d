/* SPDX-License-Identifier: MIT
 * Planned pieces -> segments, just in time. [task]
 *
 * The forward half of the timing happens here, because only here the real speed is known: from the present y
 * (motion/timing.h), as fast as the axes allow and never above what the backward pass found. The path is
 * sampled in time; a sample is rounded to steps from its absolute position, so nothing adds up, and what is
 * left of a step goes into the segment's phases, so steps come when they are due and not when a segment ends.
 * A hold takes the least slope of y instead of the greatest: the shortest stop on the path that the axes
 * allow. */
#ifndef WIFICNC_MOTION_EMIT_H
#define WIFICNC_MOTION_EMIT_H

#include "motion/axes.h"
#include "motion/beam.h"
#include "motion/gear.h"
#include "motion/history.h"
#include "motion/planner.h"
#include "motion/ramp.h"
#include "segment/ahead.h"
#include "segment/host_queue.h"

/** 1 step in units of a sum of chords: a million of them are off by less than 1/1000 step. */
#define EMIT_CORNER_BITS 31
#define EMIT_CORNER      (1ll << EMIT_CORNER_BITS)

/** State that making segments changes, in one block: it is kept at a mark, and taken back. */
#define EMIT_STATE                                                                                           \
    int64_t corner[CORE_AXES]; /* control point at the end of the piece at tail, 1/EMIT_CORNER step */       \
    uint64_t dwelt_ns;         /* made of dwell_ns, since the last reset */                                  \
    struct axes axes;          /* their shaper is one of the plan's */                                       \
    float along_mm;            /* from the control point before to the place on the straight part ... */     \
    float along_rest_mm;       /* ... and what a float loses of it: a slow move is many small sums */        \
    float left;                /* of this half of a blend, 0.5 .. 0 of all of it */                          \
    float y;                   /* motion/timing.h */                                                         \
    float path_mm_s;           /* speed of the path, which the axes follow */                                \
    ramp_state ramp;           /* of its acceleration */                                                     \
    uint32_t piece_at;         /* place where the piece at tail begins (motion/power.h) */                   \
    struct power_place power;  /* at the end of the last segment */                                          \
    uint16_t next_id;                                                                                        \
    uint8_t ended_flags; /* of the piece that ended in the last stop; enum motion_flags */                   \
    bool entered;        /* the piece at tail has begun */                                                   \
    bool on_blend;       /* of that, or else along_mm of its straight part */                                \
    bool second_half;    /* of the blend */                                                                  \
    bool settles;        /* at an exact stop, until the axes have come there, too */                         \
    bool late;           /* limits were lowered; not yet down to them */                                     \
    bool ran_dry         /* came to rest for want of a next move */

struct emit_state {
    EMIT_STATE;
};

/** What is kept at a mark. What others change (the plan, hold, overrides, the spindle) is not part of it. */
struct emit_place {
    struct emit_state state;
    uint32_t tail, stop_tail; /* of the path */
    uint32_t limits;          /* emit.limits then */
    struct history_place history;
    struct gear_place gear;
};

/** The same of a host's motion; motion/hosted.h. */
struct hosted_place {
    struct host_queue_place queue;
    struct history_place history;
    struct axes axes;
};

/** Motion has one owner, so marks have states of one kind. */
union emit_mark {
    struct emit_place place;
    struct hosted_place hosted;
};

/** dy/dt on a half of a blend, which stays legal to its end: on a straight line between two places that are.
 */
struct emit_slope {
    uint32_t half; /* twice its index, plus 1 for the second; only while: */
    bool known;
    bool plan;   /* it leads to end_y, the plan's; or else it is a stop's */
    float end_y; /* the plan's, when it was found */
    float value;
};

struct emit {
    struct plan *plan;
    struct ahead *ahead;
    union {
        struct {
            EMIT_STATE;
        };
        struct emit_state state;
    };
    struct history history;          /* of the path */
    struct history_shape shape;      /* where the axes are, if the shaper is on */
    struct gear gear;                /* motion that follows the spindle; nothing is planned meanwhile */
    struct spindle spindle;          /* what it follows */
    uint32_t now_us;                 /* of this poll */
    struct beam beam;                /* a laser */
    struct emit_slope slope;         /* of the blend at tail */
    bool flush;                      /* nothing follows: coming to rest is not counted as starved */
    bool hold, hold_asked;           /* slow down along the path and stand; asked: not only to make a stop */
    bool waits;                      /* at rest, for more moves: nothing is made */
    uint32_t limits;                 /* counts changes of them */
    enum ahead_stop stop;            /* what is made is one ... */
    uint32_t stop_samples;           /* ... so many samples of it */
    float stop_first_s, stop_most_s; /* its first segment, and the longest */
    float stop_v_mm_s;               /* where it begins */
    uint32_t work;                   /* the newest segment took, in stretches of the path */
    uint32_t starved;                /* times a next move came after it had run dry */
    uint64_t dwell_ns;               /* asked for since the last reset */
    int64_t lent_in[SHAPER_LANES];   /* where the path rests while a host's motion has the history; only if */
    bool lent;
    union emit_mark places[QUEUE_MARKS];
};

void emit_init(struct emit *emit, struct plan *plan, struct ahead *ahead);

/** Stand still at the plan's position; the piece being emitted is forgotten. After plan_reset(). */
void emit_reset(struct emit *emit, const int32_t position_steps[AXIS_COUNT]);

/** The plan has new limits. At rest. */
void emit_set_shaper(struct emit *emit);

/** At rest: all that is not made yet, and where it begins, moves by so much. */
void emit_shift(struct emit *emit, const int32_t steps[AXIS_COUNT]);

/** Nothing is behind: a host's motion has the history and the marks until emit_claim() or emit_reset(). */
void emit_lend(struct emit *emit);

/** Motion becomes the planner's, when that of another source has come to rest. */
bool emit_claim(struct emit *emit);

/** Slow down along the path and stand; or continue. */
void emit_hold(struct emit *emit, bool on);

/** What a laser makes of S. */
void emit_set_beam(struct emit *emit, const struct beam *beam);

/** The limits of what is planned were changed by an override. */
void emit_change_limits(struct emit *emit);

/** Let a dwell follow the last move. Only when emit_is_idle(). @param seconds  0 .. 1e6 */
void emit_dwell(struct emit *emit, double seconds);

/** Follow the spindle along this path. Only when emit_is_idle(); the path begins where it is. The machine
 * keeps emit->spindle and the follower's clock up to date, and takes the position again when all of it is
 * done (motion_reset()). */
void emit_gear(struct emit *emit, const struct gear_path *path);

/** Nothing planned and nothing half emitted. (It may not be stepped yet.) */
bool emit_is_idle(const struct emit *emit);

/** Standing still because of a hold: nothing more comes until it is lifted. (It may not be stepped yet.) */
bool emit_is_held(const struct emit *emit);

/** The stop at the end of the pieces is so near that more of the path would be needed now to keep the speed.
 */
bool emit_wants_more(const struct emit *emit);

/** Length at the end of the newest piece that is not needed for braking to a stop there, mm. */
float emit_slack_mm(const struct emit *emit);

/** Control point at the end of the piece at tail, or before it while that has not begun, joints in mm. */
void emit_corner_mm(const struct emit *emit, double at_mm[AXIS_COUNT]);

/** Source line that the newest segment is of, while there is more of that piece; else 0. */
uint32_t emit_line(const struct emit *emit);

#endif
