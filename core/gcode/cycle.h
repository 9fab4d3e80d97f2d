/* SPDX-License-Identifier: MIT
 * A canned cycle as a stream of moves, dwells and spindle stops. [task] Resumable: the caller takes the next
 * action when it has done the last.
 *
 * 1. Only below R: a rapid up to R, once.
 * 2. A rapid over the hole, then one down to R.
 * 3. Feed to the bottom in pecks of Q (G73, G83). Between two pecks G73 lifts by CYCLE_LIFT_MM; G83 leaves
 *    the hole to R and goes back down to CYCLE_LIFT_MM above the last peck.
 * 4. Dwell P (G82 G86 G89); the spindle stops (G86).
 * 5. Out to R at feed (G85 G89); then a rapid to the clear level, and the spindle starts again (G86).
 * 2 to 5 for each hole.
 *
 * A move that would not move is left out. */
#ifndef WIFICNC_GCODE_CYCLE_H
#define WIFICNC_GCODE_CYCLE_H

#include "base/axis.h"
#include "gcode/gcode.h"

#include <stdbool.h>
#include <stdint.h>

/** How far G73 lifts, and how far above the last peck G83's rapid ends (RS274/NGC: 0.010 inch); never
 * above R. */
#define CYCLE_LIFT_MM 0.254

enum cycle_kind {
    CYCLE_ACTION_RAPID,
    CYCLE_ACTION_FEED,
    CYCLE_ACTION_DWELL,
    CYCLE_ACTION_SPINDLE_STOP,
    CYCLE_ACTION_SPINDLE_START, /* in the direction it had */
};

struct cycle_action {
    enum cycle_kind kind;
    double target_mm[AXIS_COUNT]; /* of rapid and feed: machine coordinates; else where it happens */
    float dwell_s;                /* of the dwell, >= 0 */
};

struct cycle {
    struct gcode_drill drill;
    double at_mm[AXIS_COUNT];
    double last_mm[2]; /* the last hole */
    uint32_t hole, peck;
    uint8_t axes[2], normal;
    uint8_t step; /* enum step of cycle.c */
};

/** Start at start_mm with a resolved move (MOTION_CYCLE). */
void cycle_begin(struct cycle *cycle, const double start_mm[AXIS_COUNT], const struct gcode_move *move);

/** Next action. @return false when all are done; the tool then is at move->target_mm. */
bool cycle_next(struct cycle *cycle, struct cycle_action *action);

#endif
