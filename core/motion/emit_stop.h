/* SPDX-License-Identifier: MIT
 * How long the segments are of a stop that only a late task needs (docs/motion.md section 7). Behind
 * motion/emit.h. [task] */
#ifndef WIFICNC_MOTION_EMIT_STOP_H
#define WIFICNC_MOTION_EMIT_STOP_H

struct emit;
struct shaper;

/** A stop begins, at the present speed. */
void emit_stop_begin(struct emit *emit);

/** The same of the axes of any source. @param brakes_s  time until its path rests */
void emit_stop_lengths(struct emit *emit, const struct shaper *shaper, float v_mm_s, float brakes_s);

/** The next segment's duration, where the path is followed itself: its chord leaves a bend by as much as the
 * first one would where all of the acceleration is needed for turning, a T^2/8. @return s */
float emit_stop_sample_s(const struct emit *emit);

/** The same without the path at hand: segments grow as it slows down, so that their chords leave a curve by
 * less than the first one's. @return s; time_s where no stop is made */
float emit_stop_longer_s(const struct emit *emit, float v_mm_s, float time_s);

#endif
