/* SPDX-License-Identifier: MIT
 * How long a segment is: of what is committed, and of a stop that only a late task needs (docs/motion.md
 * sections 7 and 8). Behind motion/emit.h. [task] */
#ifndef WIFICNC_MOTION_EMIT_SAMPLE_H
#define WIFICNC_MOTION_EMIT_SAMPLE_H

struct emit;
struct piece;

/** Travel for one segment, or to a stop, or to where another kind of motion than this one begins. @return s
 */
float emit_travel_sample(struct emit *emit, const struct piece *piece);

/** Travel for this time, or to an exact stop. @return s */
float emit_travel_time(struct emit *emit, float time_s);

/** A stop begins, at the present speed. */
void emit_stop_begin(struct emit *emit);

/** The next segment's duration where the path is not at hand: segments grow as a stop slows down, so that
 * their chords leave a curve by less than the first one's. @return s; time_s where no stop is made */
float emit_stop_longer_s(const struct emit *emit, float time_s);

#endif
