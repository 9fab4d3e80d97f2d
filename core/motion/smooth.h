/* SPDX-License-Identifier: MIT
 * Knots -> pieces: relax, place, blend. Behind motion/path.h. [task] */
#ifndef WIFICNC_MOTION_SMOOTH_H
#define WIFICNC_MOTION_SMOOTH_H

#include "motion/path.h"

/** Append a knot at the end of this chord, and move the knots before it one stage on. */
void smooth_knot(struct path *path, const vec *chord, float length_mm, const struct chord_info *info);

/** The newest knot is a stop: all knots become pieces. */
void smooth_end(struct path *path);

#endif
