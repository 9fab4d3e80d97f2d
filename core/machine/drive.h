/* SPDX-License-Identifier: MIT
 * All between the planner and the pins as one: whether it is at rest, and how it is stopped and emptied.
 * [task]
 */
#ifndef WIFICNC_MACHINE_DRIVE_H
#define WIFICNC_MACHINE_DRIVE_H

#include "machine/machine.h"
#include "machine/timer.h"
#include "motion/joints.h"
#include "motion/motion.h"
#include "step/isr.h"
#include "step/prep.h"

/** From the planner to the pins. */
struct machine_drive {
    struct joints joints;
    struct motion motion;
    struct prep prep;
    struct step step;
    uint32_t late_seen;              /* motion.ahead.late at the last poll */
    uint32_t late_dial;              /* of it, what is no underrun: its end grew while it was published */
    uint32_t late_told;              /* underruns that were reported */
    struct machine_timer late_quiet; /* ... and none are until this is over */
    uint32_t started_us;             /* of the motion side: when the step timer was started last */
    uint32_t starts;                 /* ... and how often; wraps */
};

/** Nothing moves and nothing will before a resume: at rest, or held. */
bool drive_is_stopped(const struct machine *machine);

/** Run work(arg) in the context that starts and stops the step ISR, and wait for it. */
void drive_on_motion_side(struct machine *machine, void (*work)(void *arg), void *arg);

/** Stop immediately, discard all that was planned; the position is the steps that have left the pins. */
void drive_halt(struct machine *machine);

/** Motion is at rest: discard all that was planned and continue from `position`. */
void drive_stand_at(struct machine *machine, const int32_t position[AXIS_COUNT]);

/** Held and at rest: what is planned moves by so many steps. The axes are brought there before it continues.
 */
void drive_shift(struct machine *machine, const int32_t steps[AXIS_COUNT]);

/** Motion is at rest: discard what was planned and continue from the steps that have left the pins. */
void drive_drop(struct machine *machine);

/** What moves by the queue of network hosts has got more: the stop that is planned is not the end. */
void drive_lengthen(struct machine *machine);

/** At rest; if not, nothing more is waited for, so that it comes to rest. */
bool drive_rest_reached(struct machine *machine);

/** The program continues from where the planner is. */
void drive_take_position(struct machine *machine);

#endif
