/* SPDX-License-Identifier: MIT
 * The segments of a network host: where they lead, how far they are, and how they are given up. [task] */
#ifndef WIFICNC_MACHINE_HOST_MOTION_H
#define WIFICNC_MACHINE_HOST_MOTION_H

#include "machine/host.h"
#include "machine/machine.h"
#include "motion/move.h"

/** The step ISR is halted, and nothing has been forgotten yet. */
void host_note_done(struct machine *machine);

/** The motion side is halted: what a host has queued is given up. */
void host_drop(struct machine *machine);

/** The machine's limits have changed. */
void host_set_limits(struct machine *machine, const struct motion_limits *limits);

/** Nothing of a host comes before a resume, or at all. (The ring may still hold motion.) */
bool host_is_quiet(const struct machine *machine);

/** Take all segments that follow without a gap.
 * @return false: the one at the queue's head leaves the travel, and is not taken */
bool host_take_segments(struct machine *machine);

/** The tool may be where the joints are then. */
bool host_in_travel(const struct machine *machine, const int32_t steps[AXIS_COUNT]);

/** A segment that no host has sent: of a job that returns, or of the operator. @return false: no room */
bool host_move_self(struct machine *machine, const struct host_queue_segment *segment);

/** At rest: what is left of those is given up. */
void host_stop_self(struct machine *machine);

/** The machine is at rest: what is queued is given up, and it continues from there. */
void host_discard_queue(struct machine *machine);

#endif
