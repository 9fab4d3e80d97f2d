/* SPDX-License-Identifier: MIT
 * Where the tool is <-> where the joints are <-> how many steps that is. [task] One file per machine.
 *
 * A joint is what one motor moves (or two that share an axis). The planner plans in joints, so that limits of
 * motors hold exactly; steps_per_mm, rates and accelerations are theirs. Joints count mm, or degrees where
 * they turn. The tool counts mm in machine coordinates. Axes that a kinematics does not mix are the same in
 * both. */
#ifndef WIFICNC_MOTION_KINEMATICS_H
#define WIFICNC_MOTION_KINEMATICS_H

#include "base/axis.h"
#include "motion/kinematics/kinds_gen.h"

#include <stdbool.h>
#include <stdint.h>

/** $80 */
enum kinematics_kind {
#define KIND(NAME, name) KINEMATICS_##NAME,
    KINEMATICS_KINDS(KIND)
#undef KIND
        KINEMATICS_COUNT
};

struct kinematics;

/** A kind of machine. */
struct kinematics_ops {
    /** Where the tool is. */
    void (*forward)(const struct kinematics *kinematics, const double joints[AXIS_COUNT],
                    double tool_mm[AXIS_COUNT]);
    /** Where the joints must be: of all ways the one nearest to `near`. @param tool_mm  can be reached */
    void (*inverse)(const struct kinematics *kinematics, const double tool_mm[AXIS_COUNT],
                    const double near[AXIS_COUNT], double joints[AXIS_COUNT]);
    /** Bound on how far the tool gets from the straight line between two places when every joint goes evenly
     * from one to the other, mm. NULL: not at all, the kinematics is linear. */
    double (*bend_mm)(const struct kinematics *kinematics, const double from[AXIS_COUNT],
                      const double to[AXIS_COUNT]);
    /** mm that the tool moves at most when the joints move by 1 (all together), anywhere between two places.
     * @return >= 1 */
    double (*stretch)(const struct kinematics *kinematics, const double from[AXIS_COUNT],
                      const double to[AXIS_COUNT]);
    /** Radii that X and Y can reach. NULL: all. */
    void (*reach_mm)(const struct kinematics *kinematics, double *least_mm, double *most_mm);
    bool coupled; /* both motors of X and Y move either axis, so switches are those of the tool */
};

struct kinematics {
    const struct kinematics_ops *ops;
    double arm_mm[2];    /* SCARA: at the hub, at the tool */
    double travel_mm[2]; /* of the X and Y joints, 0: endless */
    axis_mask_t curved;  /* axes whose joints are something else: their travel is not a rectangle */
    bool coupled;        /* X and Y switches are those of the tool, not of the joints */
};

/* One of each kind, in a file of its name. */
#define KIND(NAME, name) extern const struct kinematics_ops kinematics_##name;
KINEMATICS_KINDS(KIND)
#undef KIND

/** @param arm_mm  > 0; @param travel_mm  >= 0 */
void kinematics_init(struct kinematics *kinematics, enum kinematics_kind kind, const float arm_mm[2],
                     const float travel_mm[2]);

/** The tool can go straight from one place to the other. */
bool kinematics_reaches(const struct kinematics *kinematics, const double from_mm[AXIS_COUNT],
                        const double to_mm[AXIS_COUNT]);

/** The end of a homing axis that the switch at this side marks, mm or degrees.
 *  @param travel  of the axis */
double kinematics_end(const struct kinematics *kinematics, unsigned axis, bool positive, double travel);

/** [any] Steps of the joints -> steps of the axes that have switches: the tool's where the joints are
 * coupled, else the joints' own. Whole steps, rounded down; X and Y have the same steps per mm then. */
static inline void kinematics_axis_steps(const struct kinematics *kinematics, int32_t steps[AXIS_COUNT]) {
    if (!kinematics->coupled)
        return;
    int32_t a = steps[0], b = steps[1];
    steps[AXIS_X] = (a + b) >> 1;
    steps[AXIS_Y] = (a - b) >> 1;
}

/** [any] The other way round. */
static inline void kinematics_joint_steps(const struct kinematics *kinematics, int32_t steps[AXIS_COUNT]) {
    if (!kinematics->coupled)
        return;
    int32_t x = steps[AXIS_X], y = steps[AXIS_Y];
    steps[0] = x + y;
    steps[1] = x - y;
}

/* ---- steps.c ---- */

/** Motor positions of joint positions: nearest whole steps, halves away from zero. Absolute, so rounding
 * never adds up.
 *  @param target_mm  joints, kinematics_in_range()
 *  @param axis_count  axes that exist; the others' steps are not written */
void kinematics_target_steps(const double target_mm[AXIS_COUNT], const float steps_per_mm[AXIS_COUNT],
                             unsigned axis_count, int32_t steps[AXIS_COUNT]);

/** True when the joints' steps fit the counters with room for any difference: |steps| < 2^30. */
bool kinematics_in_range(const double target_mm[AXIS_COUNT], const float steps_per_mm[AXIS_COUNT]);

/** Joint positions of motor positions. */
void kinematics_position_mm(const int32_t steps[AXIS_COUNT], const float steps_per_mm[AXIS_COUNT],
                            double position_mm[AXIS_COUNT]);

#endif
