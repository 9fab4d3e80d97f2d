/* SPDX-License-Identifier: MIT
 * What the motion room is asked for: the machine's limits, and straight moves. */
#ifndef WIFICNC_MOTION_MOVE_H
#define WIFICNC_MOTION_MOVE_H

#include "base/axis.h"

#include <stdbool.h>
#include <stdint.h>

/** $170: input shapers (motion/shaper.h). */
enum shaper_kind { SHAPER_OFF, SHAPER_ZV, SHAPER_MZV, SHAPER_EI, SHAPER_EI_2 };

/** The vibration of an axis that its shaper cancels. */
struct shaper_mode {
    enum shaper_kind kind;
    float hz;      /* > 0 */
    float damping; /* damping ratio, 0 .. 0.5 */
};

/** An axis is no faster than it stops from in this time: the stop that a late task needs must fit into a
 * batch (motion/emit_stop.h). With 20 mm/s2 or more no way is long enough to notice. */
#define MOTION_LONGEST_STOP_S 100.0f

/** Limits of the machine, in the planner's units. */
struct motion_limits {
    float steps_per_mm[AXIS_COUNT];  /* > 0; steps per degree on rotary axes */
    float max_rate_mm_s[AXIS_COUNT]; /* > 0; already within the board's step rate */
    float accel_mm_s2[AXIS_COUNT];   /* > 0 */
    float junction_deviation_mm;     /* >= 0, $11: how far the path may lie off the programmed one */
    float jerk_mm_s3;                /* >= 0, $40; 0: none is limited */
    struct shaper_mode shaper[AXIS_COUNT];
    bool shape_host;    /* they are for the motion of a network host, too */
    bool coupled;       /* the shapers of X and Y are for the sum and the difference of these joints */
    uint8_t axis_count; /* axes that exist: X .. */
};

/** How a move is to be made. */
enum motion_flags {
    MOTION_FLAG_RAPID = 0x01,      /* as fast as the axes allow */
    MOTION_FLAG_EXACT_STOP = 0x02, /* rest at the end (G61, G61.1, probing) */
    MOTION_FLAG_PROBE = 0x04,
    MOTION_FLAG_JOG = 0x08,
    MOTION_FLAG_UNSHAPED = 0x20, /* exactly where the switch is: homing, probing; it ends at rest */
    MOTION_FLAG_CUT = 0x10,      /* G1 to G3 and splines of a program: what a laser burns */
};

/** One straight move. */
struct motion_line {
    double target_mm[AXIS_COUNT]; /* machine coordinates, kinematics_in_range() */
    float feed_mm_s;              /* > 0 unless rapid; along X Y Z, or degrees/s when only rotary axes move */
    float duration_s;             /* > 0: take this long instead (G93) */
    float tolerance_mm;           /* >= 0: instead of $11, if larger (G64 P) */
    uint32_t line;                /* source line */
    uint32_t note;                /* moves of different notes stay apart; any number */
    float rpm;                    /* S of a laser with M3 or M4, else 0; of different S, too */
    float spent_mm;               /* >= 0: how far it lies off what was programmed (an arc's chord, $12) */
    uint8_t flags;                /* enum motion_flags */
};

#endif
