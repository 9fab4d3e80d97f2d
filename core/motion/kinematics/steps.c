/* SPDX-License-Identifier: MIT
 * Joint positions <-> whole steps. */
#include "motion/kinematics/kinematics.h"

void kinematics_target_steps(const double target_mm[AXIS_COUNT], const float steps_per_mm[AXIS_COUNT],
                             unsigned axis_count, int32_t steps[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < axis_count; ax++) {
        double exact = target_mm[ax] * (double)steps_per_mm[ax];
        steps[ax] = (int32_t)(exact < 0.0 ? exact - 0.5 : exact + 0.5);
    }
}

void kinematics_position_mm(const int32_t steps[AXIS_COUNT], const float steps_per_mm[AXIS_COUNT],
                            double position_mm[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        position_mm[ax] = (double)steps[ax] / (double)steps_per_mm[ax];
}

bool kinematics_in_range(const double target_mm[AXIS_COUNT], const float steps_per_mm[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        /* single: the bound need not be exact, and double is software on most chips */
        const float near = (float)target_mm[ax] * steps_per_mm[ax];
        if (!(near > -1073741824.0f && near < 1073741824.0f))
            return false;
    }
    return true;
}
