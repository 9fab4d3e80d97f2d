/* SPDX-License-Identifier: MIT
 * Chords -> a smooth path: the geometry of the planner, derived in docs/motion.md. [task]
 *
 *   path_chord() -> grade -> knots: relax (3 times) -> place -> blend -> pieces
 *
 * A knot is the end of a chord. Its control point may lie up to `tube_mm` next to it. Each control point is
 * rounded by one symmetric quadratic Bezier curve, so the path is a chain of pieces: straight, then curved,
 *
 *       from ------------ line ------------. d
 *       |<- d of the last ->|             d \      d: the blend's tangent, on this chord and on the next
 *                                            \
 *
 * and its direction never jumps. All of it works on differences of neighbours, in float32; positions are sums
 * in double, and what rounding leaves is taken along to the next chord, so nothing drifts. */
#ifndef WIFICNC_MOTION_PATH_H
#define WIFICNC_MOTION_PATH_H

#include "config.h"
#include "hal/core_sizes.h"
#include "motion/move.h"
#include "motion/shaper.h"
#include "motion/vec.h"

/** PLAN_SIZE pieces (hal/core_sizes.h): look-ahead, and what may have to be planned again. */
_Static_assert((PLAN_SIZE & (PLAN_SIZE - 1)) == 0, "ring index is masked");

/** How often each control point is relaxed: first when there are two knots behind it, and at each of the
 * next. */
#define PATH_VISITS 3u
/** Knots behind the newest one until the path there is final. */
#define PATH_LAG  (5u + PATH_VISITS)
#define KNOT_RING 16u
/** Stops ahead; a power of two. More of them wait for room. */
#define PATH_STOPS 32u
_Static_assert((KNOT_RING & (KNOT_RING - 1)) == 0 && KNOT_RING >= PATH_LAG + 3, "blend looks one knot back");

/** What a chord inherits from its moves. */
struct chord_info {
    float asked_mm_s; /* along the chord, 1e15: rapid */
    float tube_mm;    /* how far the path may lie off the chord */
    uint32_t line;
    uint32_t note;
    uint32_t units; /* of its length (motion/power.h) */
    uint8_t flags;  /* enum motion_flags */
};

struct knot {
    vec chord;       /* from the knot before to this one, mm */
    vec shift;       /* control point - knot, mm */
    vec unit;        /* of the chord between control points that ends here */
    vec turn;        /* unit of the next chord - unit */
    float length_mm; /* of the chord between control points that ends here */
    float sine;      /* of half the turn's angle */
    float depth_mm;  /* how deep below its control point the blend may pass */
    float tangent_mm;
    struct chord_info info;
    bool stop; /* the machine rests here, and exactly here */
};

/** In addition to enum motion_flags. ARRIVE: passed at rest; the path continues when the axes have come
 * there. */
enum piece_flags { PIECE_STOP = 0x80, PIECE_ARRIVE = 0x40 };

/** A chord between two control points and the blend at its end. */
struct piece {
    vec unit; /* zero lanes where no axis moves */
    float length_mm;
    float tangent_mm;  /* 0: no blend, the corner is passed at rest */
    float asked_sq;    /* (mm/s)^2 along the chord at 100 % */
    float limit_sq;    /* (mm/s)^2 along the chord that the axis rates allow */
    float bend_sq;     /* the same in the middle of the blend; and what limited jerk allows in it */
    float accel_mm_s2; /* along the chord: every axis inside its limit */
    float near_mm;     /* so much of both chords is next to the blend at its end; or of this one to a stop */
    float enter_y;     /* greatest y at the start of the straight part (motion/timing.h) */
    float blend_y;     /* ... at its end, where the blend begins */
    float middle_y;    /* ... in the middle of the blend */
    uint32_t line;
    uint32_t note;
    uint32_t units; /* of its length (motion/power.h) */
    uint8_t flags;
};

/** A chord that waits for its successor, to be graded. */
struct chord_wait {
    vec chord;
    float length_mm;
    struct chord_info info;
};

struct path {
    /* set by path_set_limits() */
    vec accel, inverse_accel, inverse_rate; /* accel: in bends and next to them */
    vec inverse_far;                        /* on straight ways */
    vec spread;                             /* half of the second moment of each axis' shaper, s^2 */
    bool uneven; /* they differ, so that straight ways bend where speed changes, by up to: */
    bool cuts; /* at a place of rest the mean of the ways before and behind it may be farther off than that */
    float room_mm;
    float across_mm_s2; /* the most across the path: with limited jerk the mean then stays in the tolerance */
    float corner_s2; /* that times the accelerations on both of its ways is how far the mean cuts a corner */
    float cut_sine;  /* less than this of half a turn: no farther than room_mm */
    float near_s;    /* this time before and after a bend is next to it ... */
    float near_part; /* ... where this part of accel_mm_s2 is used */
    float
        mean_s; /* of limited jerk, where it leaves more acceleration far from bends (motion/ramp.h); or 0 */
    float calm_part; /* as near_part, between that and the rest */
    /* knots */
    struct chord_wait wait;
    bool waits;
    float before_mm;                  /* length of the chord before the one that waits; 0: a stop */
    uint32_t newest, placed, blended; /* knots up to here; wrap at 2^32 */
    vec lost;                         /* mm, what rounding of the pieces' chords left for the next one */
    struct knot knots[KNOT_RING];
    /* pieces */
    uint32_t head, tail, kept;      /* kept: from here on a part may have to be travelled again (emit.h) */
    struct piece pieces[PLAN_SIZE]; /* the one before `kept` is there, too: its blend ends in that piece */
    int32_t stop_steps[PATH_STOPS][AXIS_COUNT]; /* exact positions of the coming stops */
    uint32_t stop_head, stop_tail, stop_kept;
    /* a last stop that is there only because nothing followed */
    bool may_go_on; /* so is the newest one, and the next chord may pass it at speed */
    bool reopened;  /* that chord came: the stop's piece gets a blend, if there still is room for it */
    bool changed;   /* that happened: all timing is new */
    float slack_mm; /* room: of the piece's end, what is not needed for braking; from motion/emit.h */
};

static inline struct piece *path_piece(struct path *path, uint32_t index) {
    return &path->pieces[index & (PLAN_SIZE - 1)];
}
static inline uint32_t path_count(const struct path *path) {
    return path->head - path->tail;
}

/** Knots and chords not yet made into pieces. */
static inline uint32_t path_pending(const struct path *path) {
    return path->newest - path->blended + (path->waits ? 1u : 0u);
}

/** Whether the newest piece ends in a stop that stays one. */
static inline bool path_is_closed(const struct path *path) {
    return path->knots[path->newest & (KNOT_RING - 1)].stop && !path->may_go_on && path_pending(path) == 0;
}

/** @param part  of the accelerations, for bends and the straight ways next to them
 *  @param far  times the accelerations, on the rest of straight ways */
void path_set_limits(struct path *path, const struct motion_limits *limits, float part, float far);

/** After that: mean_s and calm_part. */
void path_set_jerk(struct path *path, float mean_s, float calm_part);

/** After that. @param near_s  how long before and after a bend is next to it
 *  @param room_mm  so far shaping may take the axes off the path */
void path_set_shaper(struct path *path, const struct shaper *shaper, float near_s, float room_mm);

/** Length of a piece's straight way that is next to the blend before it and that at its end. */
static inline float piece_near_mm(const struct piece *piece, const struct piece *before, float line_mm) {
    float near_mm = (before->tangent_mm > 0.0f ? before->near_mm : 0.0f) + piece->near_mm;
    return min_f(near_mm, line_mm);
}

/** Length of a piece's chord where only a part of the acceleration is used. */
static inline float piece_slow_mm(const struct piece *piece, const struct piece *before) {
    float bends_mm = before->tangent_mm + piece->tangent_mm;
    return bends_mm + piece_near_mm(piece, before, max_f(piece->length_mm - bends_mm, 0.0f));
}

/** Empty and at rest. */
void path_reset(struct path *path);

/** Append a chord; there is room for all that it and path_end() make (plan_free()). */
void path_chord(struct path *path, const vec *chord, float length_mm, const struct chord_info *info);

/** All chords so far become pieces, and the last one ends at rest at this position.
 *  @param may_go_on  a chord that comes early enough may still pass it at speed */
void path_end(struct path *path, const int32_t stop_steps[AXIS_COUNT], bool may_go_on);

#endif
