/* SPDX-License-Identifier: MIT
 * Motion of a network host as a source of segments: its slices as they are, or shaped (`$176`). [task]
 *
 * The host's steps are the path: shapers and limited jerk make of it what they make of the planner's. So the
 * axes are later than the host's segments by shaper.late_ns, and its corners are rounded by half of the
 * second moment of the weights times the acceleration (motion/shaper.h); the host has planned the path, so
 * nothing is slower for that. Segments that probe are followed exactly, with a rest before and after them. */
#ifndef WIFICNC_MOTION_HOSTED_H
#define WIFICNC_MOTION_HOSTED_H

#include "motion/emit.h"
#include "segment/host_queue.h"

struct hosted {
    struct emit *emit; /* whose history it borrows while motion is the host's */
    struct host_queue *queue;
    struct axes axes;
    uint32_t work; /* the newest segment took, in slices */
};

/** Nothing moves. */
void hosted_init(struct hosted *hosted, struct emit *emit, struct host_queue *queue);

/** Publish what the queue has, once motion is the host's.
 *  @return true when anything was. Never blocks. */
bool hosted_poll(struct hosted *hosted);

#endif
