/* SPDX-License-Identifier: MIT
 * The forward pass: along the pieces in time. Behind motion/emit.h. [task] */
#ifndef WIFICNC_MOTION_FORWARD_H
#define WIFICNC_MOTION_FORWARD_H

#include "motion/emit.h"

/** Travel on for at most `time_s`, and not beyond the end of the present part of the piece at tail, nor
 * beyond a change of acceleration on it. @return the time it took, s; 0: only the part changed, or nothing */
float travel(struct emit *emit, float time_s);

/** The piece whose power and kind belong to that place: a corner's middle is where the next one begins. */
const struct piece *travel_piece(const struct emit *emit);

/** Where that is along all chords: motion/power.h. */
uint32_t travel_power_place(const struct emit *emit);

/** Where that is, mm, relative to emit->corner. @return speed along the path, mm/s */
float travel_position(const struct emit *emit, float from_corner_mm[AXIS_COUNT]);

/** With y = 0, as it is where no piece is left: that is the end of all pieces, or motion is held. */
bool travel_rests(const struct emit *emit);

/** Nothing to travel on: at rest at the end of all pieces, or held. */
static inline bool travel_ends(const struct emit *emit) {
    return emit->y <= 0.0f && travel_rests(emit);
}

#endif
