/* SPDX-License-Identifier: MIT
 * Where the machine is: steps that have left the pins, and what they mean. [task] */
#ifndef WIFICNC_MACHINE_PLACE_H
#define WIFICNC_MACHINE_PLACE_H

#include "config.h"
#include "machine/machine.h"

/** How far the position can be relied on. */
struct machine_trust {
    axis_mask_t axes;                /* axes that were homed, and not stopped without a ramp since */
    uint8_t losses;                  /* times that motion was stopped without a ramp; wraps */
    int32_t shift_steps[AXIS_COUNT]; /* by which homing has moved the counters against the pulses */
};

/** Where these axes are is no longer known. */
static inline void trust_lose(struct machine_trust *trust, axis_mask_t axes) {
    trust->axes &= (axis_mask_t)~axes;
}

/** Machine position of the tool, mm. */
void place_tool_mm(const struct machine *machine, const int32_t steps[AXIS_COUNT], double mm[AXIS_COUNT]);

/** The place of the axes that have switches, steps: the tool's where the joints are coupled. [any] */
void place_axis_steps(const struct machine *machine, int32_t steps[AXIS_COUNT]);

/** The program continues from here, mm. */
void place_set_program(struct machine *machine, const double target_mm[AXIS_COUNT]);

#endif
