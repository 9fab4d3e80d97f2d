/* SPDX-License-Identifier: MIT
 * Lines that were resolved before work zero or the tool length was changed: all of their machine coordinates
 * move by as much. Pure. */
#ifndef WIFICNC_GCODE_SHIFT_H
#define WIFICNC_GCODE_SHIFT_H

#include "gcode/arc.h"
#include "gcode/cycle.h"
#include "gcode/gcode.h"
#include "gcode/spline.h"

/** A move that is not begun or under way. */
void shift_move(struct gcode_move *move, const double shift_mm[AXIS_COUNT]);

/** What is under way of one. */
void shift_arc(struct arc *arc, const double shift_mm[AXIS_COUNT]);
void shift_spline(struct spline *spline, const double shift_mm[AXIS_COUNT]);
void shift_cycle(struct cycle *cycle, const double shift_mm[AXIS_COUNT]);

/** The level that a row of cycles returns to. */
void shift_sticky(struct gcode_sticky *sticky, const double shift_mm[AXIS_COUNT]);

/** Any point. */
static inline void shift_point(double point_mm[AXIS_COUNT], const double shift_mm[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        point_mm[ax] += shift_mm[ax];
}

#endif
