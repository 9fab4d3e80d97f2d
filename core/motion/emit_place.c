/* SPDX-License-Identifier: MIT */
#include "motion/emit_place.h"

#include "motion/emit.h"

#include <string.h>

void emit_save(void *ctx, uint32_t at) {
    struct emit *emit = ctx;
    struct emit_place *place = &emit->places[at].place;
    place->state = emit->state;
    place->tail = emit->plan->path.tail;
    place->stop_tail = emit->plan->path.stop_tail;
    place->limits = emit->limits;
    place->history = emit->history.now;
    gear_save(&emit->gear, &place->gear);
}

void emit_load(void *ctx, uint32_t at, enum ahead_return why) {
    struct emit *emit = ctx;
    const struct emit_place *place = &emit->places[at].place;
    emit->slope.known = false;
    emit->state = place->state;
    emit->late = emit->late || place->limits != emit->limits;
    emit->plan->path.tail = place->tail;
    emit->plan->path.stop_tail = place->stop_tail;
    emit->ran_dry = emit->ran_dry && plan_is_empty(emit->plan);
    history_load(&emit->history, &place->history, emit->ahead->side);
    gear_load(&emit->gear, &place->gear, why == AHEAD_STOPPED);
}

/* The oldest piece that a place needs: that of its oldest sample, while those still count. */
static uint32_t oldest_piece(const struct history *history, const struct emit_place *place) {
    if (place->history.still_ns >= place->state.axes.shaper->window_ns)
        return place->tail;
    uint16_t piece = history_oldest_piece(history, &place->history, place->state.axes.shaper->window_ns);
    return place->tail - ((place->tail - piece) & (PLAN_SIZE - 1));
}

void emit_release(void *ctx, uint32_t at) {
    struct emit *emit = ctx;
    uint32_t oldest = oldest_piece(&emit->history, &emit->places[at].place);
    if ((int32_t)(oldest - emit->plan->path.kept) > 0)
        emit->plan->path.kept = oldest;
    emit->plan->path.stop_kept = emit->places[at].place.stop_tail;
    emit->plan->power.kept = emit->places[at].place.state.power.mark;
    history_release(&emit->history, &emit->places[at].place.history);
}

/* ---- of the state itself ---- */

void emit_shift(struct emit *emit, const int32_t steps[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        emit->axes.steps[ax] += steps[ax];
    for (unsigned ax = 0; ax < CORE_AXES; ax++) {
        emit->corner[ax] += steps[ax] * EMIT_CORNER;
        emit->history.now.in[ax] += (int64_t)steps[ax] * HISTORY_STEP;
        emit->lent_in[ax] += (int64_t)steps[ax] * HISTORY_STEP;
    }
}

void emit_corner_mm(const struct emit *emit, double at_mm[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < CORE_AXES; ax++)
        at_mm[ax] =
            (double)emit->corner[ax] / (double)EMIT_CORNER / (double)emit->plan->limits.steps_per_mm[ax];
}
