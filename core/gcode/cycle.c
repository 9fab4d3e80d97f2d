/* SPDX-License-Identifier: MIT
 * A canned cycle as a list of steps, most of which are left out in most cycles. */
#include "gcode/cycle.h"

#include "gcode/arc.h"

#include <string.h> // memcpy

/* In the order of the list in cycle.h. */
enum step {
    STEP_LIFT,
    STEP_HOLE,
    STEP_DOWN,
    STEP_PECK,
    STEP_CHIP_OUT,
    STEP_CHIP_BACK,
    STEP_DWELL,
    STEP_SPINDLE_STOP,
    STEP_OUT,
    STEP_CLEAR,
    STEP_SPINDLE_START,
    STEP_NEXT_HOLE,
    STEP_END,
};

void cycle_begin(struct cycle *cycle, const double start_mm[AXIS_COUNT], const struct gcode_move *move) {
    const uint8_t *axes = arc_plane_axes[move->plane];

    cycle->drill = move->drill;
    memcpy(cycle->at_mm, start_mm, sizeof cycle->at_mm);
    for (unsigned i = 0; i < 2; i++) {
        cycle->axes[i] = axes[i];
        cycle->last_mm[i] = move->target_mm[axes[i]];
    }
    cycle->normal = (uint8_t)(AXIS_X + AXIS_Y + AXIS_Z - axes[0] - axes[1]);
    cycle->hole = cycle->peck = 0;
    cycle->step = STEP_LIFT;
}

/* @return false: it is there already */
static bool go(struct cycle *cycle, struct cycle_action *action, enum cycle_kind kind, double level_mm) {
    if (cycle->at_mm[cycle->normal] == level_mm)
        return false;
    cycle->at_mm[cycle->normal] = level_mm;
    action->kind = kind;
    return true;
}

/* Places come from the last hole backwards, so that the last one is exact. */
static bool go_to_hole(struct cycle *cycle, struct cycle_action *action) {
    const double left = cycle->drill.repeats - 1 - cycle->hole;
    bool moves = false;

    for (unsigned i = 0; i < 2; i++) {
        const double place = cycle->last_mm[i] - left * cycle->drill.step_mm[i];
        double *at = &cycle->at_mm[cycle->axes[i]];

        moves |= *at != place;
        *at = place;
    }
    action->kind = CYCLE_ACTION_RAPID;
    return moves;
}

/* Counted from R and not from the last peck, so that rounding does not add up; the last peck ends at the
 * bottom itself. */
static double peck_level(const struct cycle *cycle, uint32_t pecks) {
    const struct gcode_drill *drill = &cycle->drill;
    return pecks >= drill->pecks ? drill->bottom_mm : drill->r_mm - pecks * drill->peck_mm;
}

static double lifted_level(const struct cycle *cycle) {
    const double level = peck_level(cycle, cycle->peck) + CYCLE_LIFT_MM;
    return level < cycle->drill.r_mm ? level : cycle->drill.r_mm;
}

/* Between two pecks: up, G73 by CYCLE_LIFT_MM and G83 to R; then back to CYCLE_LIFT_MM above the ground,
 * where G73 is already. */
static bool clear_chips(struct cycle *cycle, struct cycle_action *action, bool back) {
    const bool lifts = cycle->drill.cycle == CYCLE_CHIP;

    if (cycle->peck == cycle->drill.pecks)
        return false;
    if (back)
        cycle->step = STEP_PECK;
    return go(cycle, action, CYCLE_ACTION_RAPID, back || lifts ? lifted_level(cycle) : cycle->drill.r_mm);
}

static bool is_bored(const struct cycle *cycle) {
    return cycle->drill.cycle == CYCLE_BORE || cycle->drill.cycle == CYCLE_BORE_DWELL;
}

static bool act(struct cycle_action *action, enum cycle_kind kind, bool wanted) {
    action->kind = kind;
    return wanted;
}

/* One step, and on to the next one. @return false: there was nothing to do */
static bool take_step(struct cycle *cycle, struct cycle_action *action) {
    const struct gcode_drill *drill = &cycle->drill;
    const bool stops = drill->cycle == CYCLE_BORE_STOP;

    switch (cycle->step++) {
    case STEP_LIFT:
        return cycle->at_mm[cycle->normal] < drill->r_mm &&
               go(cycle, action, CYCLE_ACTION_RAPID, drill->r_mm);
    case STEP_HOLE:
        return go_to_hole(cycle, action);
    case STEP_DOWN:
        return go(cycle, action, CYCLE_ACTION_RAPID, drill->r_mm);
    case STEP_PECK:
        return go(cycle, action, CYCLE_ACTION_FEED, peck_level(cycle, ++cycle->peck));
    case STEP_CHIP_OUT:
        return clear_chips(cycle, action, false);
    case STEP_CHIP_BACK:
        return clear_chips(cycle, action, true);
    case STEP_DWELL:
        action->dwell_s = drill->dwell_s;
        return act(action, CYCLE_ACTION_DWELL, drill->dwell_s >= 0.0f);
    case STEP_SPINDLE_STOP:
        return act(action, CYCLE_ACTION_SPINDLE_STOP, stops);
    case STEP_OUT:
        return is_bored(cycle) && go(cycle, action, CYCLE_ACTION_FEED, drill->r_mm);
    case STEP_CLEAR:
        return go(cycle, action, CYCLE_ACTION_RAPID, drill->clear_mm);
    case STEP_SPINDLE_START:
        return act(action, CYCLE_ACTION_SPINDLE_START, stops);
    case STEP_NEXT_HOLE:
    default:
        cycle->peck = 0;
        cycle->step = ++cycle->hole < drill->repeats ? STEP_HOLE : STEP_END;
        return false;
    }
}

bool cycle_next(struct cycle *cycle, struct cycle_action *action) {
    while (cycle->step != STEP_END) {
        if (!take_step(cycle, action))
            continue;
        memcpy(action->target_mm, cycle->at_mm, sizeof action->target_mm);
        return true;
    }
    return false;
}
