/* SPDX-License-Identifier: MIT
 * Switches and buttons. [task] */
#ifndef WIFICNC_MACHINE_INPUTS_H
#define WIFICNC_MACHINE_INPUTS_H

#include "hal/hal.h"
#include "machine/machine.h"
#include "machine/motors.h"
#include "machine/switches.h"

/** Written by machine_edge_isr() too. */
struct machine_edges {
    struct switches switches;
    axis_mask_t known;              /* limits active at the last edge */
    axis_mask_t latch[MOTOR_COUNT]; /* homing: remember where the switches of these motors come on */
    volatile axis_mask_t latched[MOTOR_COUNT];
    int32_t mark[MOTOR_COUNT][AXIS_COUNT]; /* steps, where the line closed that waits */
    int32_t at[MOTOR_COUNT][AXIS_COUNT];   /* steps, where latched */
    volatile bool hard_limit, estop;       /* seen, motion is halted */
    volatile uint8_t cuts;                 /* times that the e-stop has switched the motors off; wraps */
};

/** Motion is halted: what was seen is over, and no switch is looked for. */
static inline void inputs_forget(struct machine_edges *edges) {
    edges->latch[FIRST_MOTOR] = edges->latch[SECOND_MOTOR] = 0;
    edges->hard_limit = edges->estop = false;
}

/** Take the switches as they are now, as if an edge had come. */
void inputs_look(struct machine *machine);

/** Limit switches that are hit. */
axis_mask_t inputs_limits(const struct machine *machine);

/** Switches that homing looks for, when they are hit: the home lines, or of axes without one the limits at
 * the ends to which they home ($23). @param motor  FIRST_MOTOR or SECOND_MOTOR */
axis_mask_t inputs_homing(const struct machine *machine, unsigned motor);

/** The switches are taken as they are, without an edge; at power-on. */
void inputs_begin(struct machine *machine);

/** Axes with a second motor. */
axis_mask_t inputs_ganged(const struct machine *machine);

/** Of them those whose second motor has a switch; with the others both motors stop at the first one's. */
axis_mask_t inputs_squared(const struct machine *machine);

/** The probe touches, by $6; the tool setter, by $72. */
bool inputs_probe(const struct machine *machine, const struct hal_inputs *inputs, enum hal_probe probe);

/** At the last poll. */
bool inputs_door_is_open(const struct machine *machine);

#endif
