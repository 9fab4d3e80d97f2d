/* SPDX-License-Identifier: MIT
 * What a laser's output has to show on a cut: S, override and $30 $31, and with M4 the speed. [task] Pure.
 *
 * A segment carries the duty at its start and at its end (segment/segment.h); between them it follows the
 * speed, so what a stretch gets is in proportion to its length. */
#ifndef WIFICNC_MOTION_BEAM_H
#define WIFICNC_MOTION_BEAM_H

#include "base/duty.h"

#include <stdbool.h>

struct beam {
    bool on;         /* M3 or M4 is in force, with $32=1 */
    bool with_speed; /* M4 */
    float factor;    /* of S: the spindle override */
    float feed_part; /* of F, the feed override: at this speed M4 burns with all of S */
    float rise_s;    /* from a change of the signal to that of the light */
    struct duty_range range;
};

/** Duty of a cut. @param rpm  S @param v_mm_s  speed now @param feed_mm_s  F along the same path, > 0 */
uint16_t beam_duty(const struct beam *beam, float rpm, float v_mm_s, float feed_mm_s);

/** Whether both make the same of everything. */
bool beam_is_same(const struct beam *a, const struct beam *b);

#endif
