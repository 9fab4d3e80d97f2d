/* SPDX-License-Identifier: MIT
 * Where the tool is <-> where the motors are. [task] One file per machine; cartesian today. */
#ifndef WIFICNC_MOTION_KINEMATICS_H
#define WIFICNC_MOTION_KINEMATICS_H

#include "base/axis.h"

#include <stdbool.h>
#include <stdint.h>

/** Motor positions of a tool position: nearest whole steps, halves away from zero. Absolute, so rounding
 * never adds up.
 *  @param target_mm  kinematics_in_range()
 *  @param axis_count  axes that exist; the others' steps are not written */
void kinematics_target_steps(const double target_mm[AXIS_COUNT], const float steps_per_mm[AXIS_COUNT],
                             unsigned axis_count, int32_t steps[AXIS_COUNT]);

/** True when the target's steps fit the counters with room for any difference: |steps| < 2^30. */
bool kinematics_in_range(const double target_mm[AXIS_COUNT], const float steps_per_mm[AXIS_COUNT]);

/** Tool position of motor positions, mm. */
void kinematics_position_mm(const int32_t steps[AXIS_COUNT], const float steps_per_mm[AXIS_COUNT],
                            double position_mm[AXIS_COUNT]);

#endif
