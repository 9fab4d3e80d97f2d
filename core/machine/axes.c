/* SPDX-License-Identifier: MIT
 * Which axes home, in which cycle and towards which end; and which of them are not homed. */
#include "machine/axes.h"

#include "machine/parts.h"

axis_mask_t axes_of_cycle(const struct machine *machine, unsigned cycle) {
    const struct settings *settings = &machine->settings;
    const uint8_t masks[CYCLE_COUNT] = {settings->homing_cycle_1_mask, settings->homing_cycle_2_mask,
                                        settings->homing_cycle_3_mask, settings->homing_cycle_4_mask,
                                        settings->homing_cycle_5_mask, settings->homing_cycle_6_mask};
    return masks[cycle];
}

axis_mask_t axes_in_cycles(const struct machine *machine) {
    unsigned axes = 0;
    for (unsigned cycle = 0; cycle < CYCLE_COUNT; cycle++)
        axes |= axes_of_cycle(machine, cycle);
    return (axis_mask_t)axes;
}

/* An axis without a travel has no place to home to: its position would not follow from its switch. */
axis_mask_t axes_with_ends(const struct machine *machine) {
    unsigned axes = 0;
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++)
        axes |= machine->settings.max_travel_mm[ax] > 0.0f ? 1u << ax : 0;
    return (axis_mask_t)axes;
}

double axes_direction(const struct machine *machine, unsigned axis) {
    return (machine->settings.homing_dir_mask >> axis & 1) != 0 ? -1.0 : 1.0;
}

axis_mask_t axes_not_homed(const struct machine *machine) {
    return axes_with_ends(machine) & axes_in_cycles(machine) & (axis_mask_t)~machine->trust.axes;
}
