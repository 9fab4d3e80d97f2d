/* SPDX-License-Identifier: MIT
 * Homing: find the switches, fast and then slowly, and call what was found the end of the travel.
 *
 *   per cycle ($44 ..):  seek     -> settle -> level -> back off ->
 *                        approach -> settle -> level -> back off
 *
 * Unlike Grbl the axes slow down within their limits when a switch closes: machine_edge_isr() has kept the
 * exact step at which it did, and everything is measured from there. When one of two axes has found its
 * switch, the other continues alone; so does one of two motors of an axis (square.h). [task] */
#ifndef WIFICNC_MACHINE_HOMING_H
#define WIFICNC_MACHINE_HOMING_H

#include "machine/actions.h"
#include "machine/motors.h"

/** How far homing is; machine/homing.c. From `found` on: machine/square.c. */
struct homing {
    uint8_t step, next;                     /* within the cycle; the next cycle */
    bool all;                               /* $H without letters */
    bool locked;                            /* it began in an alarm */
    axis_mask_t asked, done;                /* of $H; of the cycles so far */
    axis_mask_t axes, left;                 /* of this cycle; of these still looking for their switch */
    axis_mask_t found[MOTOR_COUNT];         /* motors whose switch is found */
    int32_t motor[MOTOR_COUNT][AXIS_COUNT]; /* where each is: steps it has made */
    int32_t from[AXIS_COUNT];               /* counters when the present motion began */
};

/** @param asked  axes, 0 = all that are in a cycle */
enum refusal homing_begin(struct machine *machine, axis_mask_t asked);

/** @return TASK_NONE when it is done, or has ended in an alarm */
enum task_stage homing_poll(struct machine *machine);

#endif
