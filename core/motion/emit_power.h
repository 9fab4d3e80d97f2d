/* SPDX-License-Identifier: MIT
 * What a laser shows on a segment. Behind motion/emit.h. [task] */
#ifndef WIFICNC_MOTION_EMIT_POWER_H
#define WIFICNC_MOTION_EMIT_POWER_H

#include <stdbool.h>
#include <stdint.h>

struct emit;
struct piece;
struct segment;

/** A laser is on, or may be before the end of the path. Without it no segment has a duty. */
bool emit_power_counts(const struct emit *emit);

/** Its duty: F is that of a piece, up to this place (motion/power.h). The axes of the segment are set.
 *  @param v0, v1  speeds of the axes at its ends, mm/s */
void emit_power(struct emit *emit, struct segment *segment, const struct piece *piece, uint32_t to, float v0,
                float v1, float time_s);

#endif
