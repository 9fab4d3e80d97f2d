/* SPDX-License-Identifier: MIT */
#include "motion/emit_place.h"

#include "motion/emit.h"

#include <string.h>

void emit_save(void *ctx, uint32_t at) {
    struct emit *emit = ctx;
    struct emit_place *place = &emit->places[at];
    place->entered = emit->entered;
    place->on_blend = emit->on_blend;
    place->settles = emit->settles;
    place->late = emit->late;
    place->ran_dry = emit->ran_dry;
    place->ended_flags = emit->ended_flags;
    place->next_id = emit->next_id;
    place->second_half = emit->second_half;
    place->left = emit->left;
    place->y = emit->y;
    place->v_mm_s = emit->v_mm_s;
    place->along_mm = emit->along_mm;
    place->along_rest_mm = emit->along_rest_mm;
    place->time_ns = emit->time_ns;
    memcpy(place->corner, emit->corner, sizeof place->corner);
    memcpy(place->steps, emit->steps, sizeof place->steps);
    memcpy(place->fraction, emit->fraction, sizeof place->fraction);
    place->tail = emit->plan->path.tail;
    place->stop_tail = emit->plan->path.stop_tail;
    place->limits = emit->limits;
    place->dwelt_ns = emit->dwelt_ns;
    place->piece_at = emit->piece_at;
    place->power = emit->power;
    place->path_mm_s = emit->path_mm_s;
    place->ramp = emit->ramp;
    place->shaper = emit->shaper;
    place->history = emit->history.now;
    gear_save(&emit->gear, &place->gear);
}

static void return_path(struct emit *emit, const struct emit_place *place) {
    struct path *path = &emit->plan->path;
    emit->late = emit->late || place->limits != emit->limits;
    path->tail = place->tail;
    path->stop_tail = place->stop_tail;
    emit->ran_dry = place->ran_dry && plan_is_empty(emit->plan);
}

void emit_load(void *ctx, uint32_t at, enum ahead_return why) {
    struct emit *emit = ctx;
    const struct emit_place *place = &emit->places[at];
    emit->slope.known = false;
    emit->entered = place->entered;
    emit->on_blend = place->on_blend;
    emit->settles = place->settles;
    emit->late = place->late;
    emit->ended_flags = place->ended_flags;
    emit->next_id = place->next_id;
    emit->second_half = place->second_half;
    emit->left = place->left;
    emit->y = place->y;
    emit->v_mm_s = place->v_mm_s;
    emit->along_mm = place->along_mm;
    emit->along_rest_mm = place->along_rest_mm;
    emit->time_ns = place->time_ns;
    memcpy(emit->corner, place->corner, sizeof emit->corner);
    memcpy(emit->steps, place->steps, sizeof emit->steps);
    memcpy(emit->fraction, place->fraction, sizeof emit->fraction);
    return_path(emit, place);
    emit->dwelt_ns = place->dwelt_ns;
    emit->piece_at = place->piece_at;
    emit->power = place->power;
    emit->path_mm_s = place->path_mm_s;
    emit->ramp = place->ramp;
    emit->shaper = place->shaper;
    history_load(&emit->history, &place->history, emit->ahead->side);
    gear_load(&emit->gear, &place->gear, why == AHEAD_STOPPED);
}

/* The oldest piece that a place needs: that of its oldest sample, while those still count. */
static uint32_t oldest_piece(const struct history *history, const struct emit_place *place) {
    if (place->history.still_ns >= place->shaper->window_ns)
        return place->tail;
    uint16_t piece = history_oldest_piece(history, &place->history, place->shaper->window_ns);
    return place->tail - ((place->tail - piece) & (PLAN_SIZE - 1));
}

void emit_release(void *ctx, uint32_t at) {
    struct emit *emit = ctx;
    uint32_t oldest = oldest_piece(&emit->history, &emit->places[at]);
    if ((int32_t)(oldest - emit->plan->path.kept) > 0)
        emit->plan->path.kept = oldest;
    emit->plan->path.stop_kept = emit->places[at].stop_tail;
    emit->plan->power.kept = emit->places[at].power.mark;
    history_release(&emit->history, &emit->places[at].history);
}
