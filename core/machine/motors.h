/* SPDX-License-Identifier: MIT
 * Power of the motors: on before the first step, off when $1 has passed since the last one. [motion side]
 * [task] */
#ifndef WIFICNC_MACHINE_MOTORS_H
#define WIFICNC_MACHINE_MOTORS_H

#include "config.h"
#include "machine/machine.h"

/** Motors of an axis. */
enum { FIRST_MOTOR, SECOND_MOTOR, MOTOR_COUNT };

/** Power of the motors: of the motion side, but for `held` and `ahead`. */
struct machine_motors {
    bool on, inverted;             /* as put out: $4 */
    bool awake;                    /* since they were switched on */
    uint8_t cuts;                  /* of machine_edges.cuts, seen */
    axis_mask_t held[MOTOR_COUNT]; /* [task] homing: these wait for the other one */
    int32_t ahead[AXIS_COUNT];     /* [task] steps of the second motor beyond the first one, from square */
    uint32_t moved_us, woken_us;   /* when something moved last; when they were switched on */
};

/** Power-on: off. [task] */
void motors_init(struct machine *machine);

/** [motion side] @return false: they wake up, no steps yet */
bool motors_poll(struct machine *machine);

/** Until they are awake; 0: they are, or off. */
uint32_t motors_wait_us(const struct machine *machine);

/** Motors of axes with two that make no steps, from standstill to standstill. */
void motors_hold(struct machine *machine, axis_mask_t first, axis_mask_t second);

/** The gantry is square: so many steps is its second motor beyond the first one. [task] */
void motors_keep_ahead(struct machine *machine, unsigned ax, int32_t steps);

/** No one waits any more. Only while nothing moves. */
void motors_release(struct machine *machine);

#endif
