/* SPDX-License-Identifier: MIT
 * Motion that follows the spindle: a path whose place is a function of the spindle's angle. [task] Pure.
 *
 *     place along the drive line = pitch * (angle - zero angle)          the thread's line
 *
 * Time is bent, the path never. In each sample the speed is chosen so that the place comes to the line, with
 * the axes inside their speeds and accelerations whatever the spindle does: toward the end of a far error
 * along a parabola of part of the acceleration, near it in proportion (docs/motion.md). A pass starts from
 * rest v^2/2a before the line crosses its start, so that it is on the line just when it has speeded up: at
 * any speed of the spindle every pass lies on the same line. It ends at rest at its end, so its last v^2/2a
 * lag behind the line.
 *
 * In addition to the drive line the path may have a depth: full immediately, or ramped up and down at the
 * ends (tapers), no steeper than `slope` and bent no more than `bend`. */
#ifndef WIFICNC_MOTION_GEAR_H
#define WIFICNC_MOTION_GEAR_H

#include "base/axis.h"
#include "config.h"
#include "motion/spindle.h"

#include <stdbool.h>
#include <stdint.h>

/** What to follow the spindle along. */
struct gear_path {
    double from_mm[AXIS_COUNT];  /* joints; depth is 0 there */
    double drive_mm[AXIS_COUNT]; /* joints, for the whole way */
    double into_mm[AXIS_COUNT];  /* joints, for the whole depth; all 0: none exists */
    float way_mm;                /* along the drive line, > 0 */
    float pitch_mm;              /* > 0, along the drive line, per revolution */
    float depth_mm;              /* >= 0 */
    float slope;                 /* of tapers, depth per way, > 0 */
    float bend_mm;               /* of tapers: change of slope per mm, > 0 */
    bool entry, exit;            /* tapers at these ends */
    bool reverses;               /* a tap: beyond the end and back, as the spindle turns */
    int8_t sense;                /* 1: the spindle turns clockwise on the way in; -1 */
    float speed_mm_s;            /* along the drive line, > 0: no axis is faster than it may be */
    float accel_mm_s2;           /* the same for the acceleration */
    float lag_s;                 /* the axes are so late behind the path (limited jerk) */
    uint32_t line;               /* source line */
};

enum gear_phase {
    GEAR_OFF,
    GEAR_WAITS, /* at the start, for gear_start() and then for the angle */
    GEAR_RUNS,
    GEAR_STOPS, /* gear_stop(): as soon as the axes can */
    GEAR_DONE,  /* at rest */
};

/** State that is kept at a mark (segment/ahead.h). There are many of them, so it has no gaps. */
struct gear_place {
    double at_mm, zero_rev;
    uint64_t run_ns;
    float v_mm_s;
    uint8_t phase; /* enum gear_phase; GEAR_OFF: nothing else is kept */
    bool locked, ends, lost;
};

struct gear {
    struct gear_path path;
    enum gear_phase phase;
    bool may_start;    /* the spindle is ready */
    bool must_stop;    /* gear_stop() */
    double at_mm;      /* along the drive line */
    float v_mm_s;      /* signed */
    double zero_rev;   /* angle at which the line is at 0 */
    bool locked;       /* was on the line since the start */
    bool ends;         /* slows down for its end, and may leave the line */
    bool lost;         /* and then came off it further than the axes could fix */
    bool clock_runs;   /* begin_us is when the first of run_ns left the pins */
    uint32_t begin_us; /* else: not yet, so not before this */
    uint64_t run_ns;   /* put out since; the emitter adds each sample */
    uint32_t starts;   /* of the step timer, seen at begin_us */
};

/** At rest at path->from_mm. */
void gear_begin(struct gear *gear, const struct gear_path *path);

/** The spindle is ready: start at the next angle that fits. */
static inline void gear_start(struct gear *gear) {
    gear->may_start = true;
}

/** Come to rest now, on the path. */
void gear_stop(struct gear *gear);

/** The same, for a stop that only a late task needs: gear_load() takes it back. */
void gear_brake(struct gear *gear);

void gear_save(const struct gear *gear, struct gear_place *place);

/** @param stopped  motion came there in a stop of gear_brake(): it follows on, as far behind as it is */
void gear_load(struct gear *gear, const struct gear_place *place, bool stopped);

/** Where the clock is: before gear_sample(), at every poll.
 *  @param standing  nothing is on its way to the pins
 *  @param started_us  when the step timer was started last
 *  @param starts  how often that happened */
void gear_clock(struct gear *gear, uint32_t now_us, bool standing, uint32_t started_us, uint32_t starts);

/** The next sample. @param sample_s  its length, at most
 *  @param whole  it must be this long, and whole, though the motion ends in it
 *  @return how long it lasts, s, >= 0; speed and place are those at its end */
double gear_sample(struct gear *gear, const struct spindle *spindle, float sample_s, bool whole,
                   uint32_t now_us);

/** Where it is, joints. */
void gear_position(const struct gear *gear, double at_mm[AXIS_COUNT]);

/** The line's place for the angle now, mm along the drive line. */
double gear_line_mm(const struct gear *gear, const struct spindle *spindle, uint32_t now_us);

/** Length of a taper, bends included, mm along the drive line. */
float gear_taper_mm(const struct gear_path *path);

/** It moves, or is about to. */
static inline bool gear_is_on(const struct gear *gear) {
    return WITH_ENCODER && gear->phase != GEAR_OFF && gear->phase != GEAR_DONE;
}

#endif
