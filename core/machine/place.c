/* SPDX-License-Identifier: MIT
 * Where the machine is: steps that have left the pins, and what they mean. */
#include "machine/place.h"

#include "machine/parts.h"

void machine_position(const struct machine *machine, int32_t steps[AXIS_COUNT]) {
    step_position(&machine->drive.step, steps);
}

void place_axis_steps(const struct machine *machine, int32_t steps[AXIS_COUNT]) {
    machine_position(machine, steps);
    kinematics_axis_steps(&machine->drive.joints.kinematics, steps);
}

void place_tool_mm(const struct machine *machine, const int32_t steps[AXIS_COUNT], double mm[AXIS_COUNT]) {
    joints_tool_mm(&machine->drive.joints, &machine->drive.motion, steps, mm);
}

float machine_speed_mm_s(const struct machine *machine) {
    struct step_now now;
    int32_t way_steps[AXIS_COUNT];
    step_look(&machine->drive.step, &now);
    if (!machine->drive.step.active)
        return 0.0f;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        /* Increments are in proportion to the speeds of the axes, which is all that a direction needs. */
        int32_t way = (int32_t)(now.increment[span_word(ax)] >> span_shift(ax) & 0xFFFFu);
        way_steps[ax] = (now.negative >> ax & 1) != 0 ? -way : way;
    }
    return joints_tool_speed(&machine->drive.joints, &machine->drive.motion, now.position, way_steps,
                             (float)now.v_um_s * 1e-3f);
}

void place_set_program(struct machine *machine, const double target_mm[AXIS_COUNT]) {
    interp_stand_at(&machine->interp, target_mm);
}
