/* SPDX-License-Identifier: MIT
 * Joint positions over time as timed segments. Pure: no HAL, no network, no clock.
 *
 * Steps are counted from absolute positions, so no fraction is lost. The controller has another clock than
 * we: durations are pulled by some 1 % towards the wanted level of its queue, so that it neither runs dry nor
 * fills up; more when it is far too long, and when the machine is at rest then, standing is cut short. A
 * servo thread that was held up and now catches up is not a way to go faster than the axes can: such a slice
 * takes longer. */
#ifndef WIFICNC_LINUXCNC_SLICER_H
#define WIFICNC_LINUXCNC_SLICER_H

#include "wire/wire_gen.h"

#include <stdbool.h>

enum { SLICER_JOINTS = 6 };

struct slicer {
    unsigned joints;
    double scale[SLICER_JOINTS];  /* steps per unit, finite and not 0 */
    double rate[SLICER_JOINTS];   /* top speed, steps/s; 0: the controller sees to it */
    double level_s;               /* motion that shall wait in the controller's queue */
    int32_t steps[SLICER_JOINTS]; /* where the segments made so far lead */
    unsigned stands;              /* segments without a step since the last one with some */
};

/** The first joint that is further away than it goes in this time at top speed, or nowhere.
 *  @return -1: none */
int slicer_far(const struct slicer *slicer, const double *position, double seconds);

/** Whether the segments made so far lead to these positions. */
bool slicer_is_there(const struct slicer *slicer, const double *position);

/** The way to these positions as a segment.
 *  @param seconds   since the last one
 *  @param queued_s  motion that waits in the controller
 *  @return -1, or the first joint whose position is none; nothing was changed then */
int slicer_slice(struct slicer *slicer, const double *position, double seconds, double queued_s,
                 struct wire_segment *segment);

#endif
