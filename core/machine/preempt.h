/* SPDX-License-Identifier: MIT
 * A network host interrupts a job of the text side, and releases motion; or the operator parks it (park.h).
 *
 *   job runs -> brakes along its path -> waits: the host moves -> released: a hold
 *        ^-- down at $57 <- outputs as they were <- up, to above where it was left <- ~
 *
 * Nothing of the job is lost: what was planned stays in the look-ahead, the current line stays as far as it
 * was, offsets and modes are no one else's. It continues from the exact step at which it was left. [task] */
#ifndef WIFICNC_MACHINE_PREEMPT_H
#define WIFICNC_MACHINE_PREEMPT_H

#include "machine/machine.h"

struct machine_host;
struct outputs_wish;

/** There is such a job, and a host may have motion: now, or when it has slowed down. */
bool preempt_may(const struct machine *machine);

/** preempt_may(): the job slows down; or motion is the host's again, because the job waits already. */
void preempt_begin(struct machine *machine);

/** The operator has switched coolant: a job that waits gets it back so. @param bits  which of COOLANT_ bits
 */
void preempt_know_coolant(struct machine_host *host, uint8_t bits, uint8_t coolant);

/** A host without motion has switched something off: a job that waits gets it back so. */
void preempt_know_off(struct machine_host *host, const struct outputs_wish *to);

/** The host lets go: the job waits for ~. @return false: something of the host still moves or waits */
bool preempt_release(struct machine *machine);

/** A hold was asked for. @return true: the job slows down already, and then the host's motion is held */
bool preempt_hold(struct machine *machine);

/** The job waits for the operator, from here on; it rests. */
void preempt_park(struct machine *machine);

/** ... and ~ has come: it returns there, and all that it has planned moves with it. @param top_steps  of Z,
 * for the way */
void preempt_unpark(struct machine *machine, const int32_t left_steps[AXIS_COUNT], int32_t top_steps);

/** A hold or the door is over: the job continues if it may, and what the planner has. */
void preempt_resume(struct machine *machine);

/** @return true when it came further */
bool preempt_poll(struct machine *machine);

#endif
