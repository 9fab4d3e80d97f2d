/* SPDX-License-Identifier: MIT
 * Homing of axes with two motors: each finds its own switch, and both end a pull-off before theirs, so that
 * the gantry is square. [task]
 *
 *   seek together ---> one switch closes, slow down ---> that motor waits, the other seeks alone
 *   both closed   ---> the one that went further behind its switch comes back alone (level)
 *                 ---> both back off together, exactly their pull-offs before their switches
 *
 * A motor waits only from standstill to standstill: no step is cut off at speed, and the step ISR knows
 * nothing of it. What the axis counts while one of them waits, the other has made; `motor` keeps where each
 * is at rest. An axis with one motor is the case in which no one ever waits.
 *
 * Where only the first motor has a switch, it counts for both: no one waits while seeking, and level makes
 * the difference of the pull-offs. That bends the gantry once: machine_motors.ahead keeps how far the second
 * motor is ahead since power-on, and homing again adds nothing. */
#ifndef WIFICNC_MACHINE_SQUARE_H
#define WIFICNC_MACHINE_SQUARE_H

#include "machine/machine.h"

/** How far both motors of an axis may be from square, mm. */
double square_crooked_mm(const struct settings *settings, unsigned axis);

/** Pull-off of a motor: $27, or a second one's own. */
float square_pull_off_mm(const struct settings *settings, unsigned motor, unsigned axis);

/** A cycle of homing begins: both motors of an axis stand where it does, or with one switch the second one
 * as far ahead as homing has brought it. */
void square_begin(struct machine *machine);

/** A search begins: no switch is found, no one waits. */
void square_search(struct machine *machine);

/** Switches have closed that were not closed before this motion. */
bool square_has_news(const struct machine *machine);

/** At rest. Take what was found; motors that found theirs wait for the other one. Leaves in homing.left
 * the axes that still look. @return false: nothing was found */
bool square_take(struct machine *machine);

/** Standing, any motion is done: keep where the motors are now. */
void square_stand(struct machine *machine);

/** One motor of this axis has found its switch and waits for the other. */
bool square_is_half(const struct machine *machine, unsigned axis);

/** How far the one that looks may still go alone, mm. */
double square_reach_mm(const struct machine *machine, unsigned axis);

/** Let the motors wait that have the shorter way back. @param[out] steps  signed way of the others; 0: none
 */
void square_level(struct machine *machine, int32_t steps[AXIS_COUNT]);

/** Both motors: signed way to a pull-off before their switches, the same for both after square_level(). */
void square_back_off(struct machine *machine, int32_t steps[AXIS_COUNT]);

/** A cycle of homing is done: both motors are at their pull-offs. */
void square_end(struct machine *machine);

/** Homing was cut off and nothing moves any more, but motors may still wait: keep where they are. */
void square_cut_off(struct machine *machine);

#endif
