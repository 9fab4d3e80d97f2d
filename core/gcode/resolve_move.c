/* SPDX-License-Identifier: MIT
 * A block's motion: where it leads, and with which feed. */
#include "gcode/resolve.h"

#include <string.h> // memcpy

/* Axes without a word keep the position that they have, bit for bit: a conversion to work coordinates and
 * back would make tiny moves of rounding errors. */
enum status resolve_target(const struct resolver *r, double target_mm[AXIS_COUNT]) {
    const bool machine_coordinates = r->nonmodal == NONMODAL_MACHINE_COORDS;
    const bool incremental = r->out->next.incremental;

    memcpy(target_mm, r->state->position_mm, AXIS_COUNT * sizeof target_mm[0]);
    for (unsigned axis = 0, left = r->axis_words; left != 0; axis++, left >>= 1) {
        double word;

        if (!(left & 1u))
            continue;
        word = resolve_axis_word(r, axis);
        if (!machine_coordinates)
            word += incremental ? target_mm[axis] : resolve_offset_mm(r, axis);
        if (!gcode_in_range(axis, word))
            return STATUS_BAD_TARGET;
        target_mm[axis] = word;
    }
    return STATUS_OK;
}

static bool is_position(const struct resolver *r, const double target_mm[AXIS_COUNT], unsigned axis_count) {
    for (unsigned axis = 0; axis < axis_count; axis++) {
        if (target_mm[axis] != r->state->position_mm[axis])
            return false;
    }
    return true;
}

/* G28, G30: with axis words go through that point and then home these axes only, else home all of them. */
static enum status home_move(const struct resolver *r, const double home_mm[AXIS_COUNT]) {
    struct gcode_move *move = &r->out->move;

    if (r->axis_words != 0) {
        const enum status status = resolve_target(r, move->via_mm);

        if (status != STATUS_OK)
            return status;
        move->via = true;
    }
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++) {
        const bool homes = r->axis_words == 0 || (r->axis_words >> axis & 1u);
        move->target_mm[axis] = homes ? home_mm[axis] : r->state->position_mm[axis];
    }
    move->motion = MOTION_RAPID;
    return STATUS_OK;
}

static void set_feed(const struct resolver *r) {
    const struct gcode_modal *next = &r->out->next;
    const bool is_arc = next->motion == MOTION_ARC_CW || next->motion == MOTION_ARC_CCW;
    struct gcode_move *move = &r->out->move;

    if (next->feed_mode == FEED_INVERSE_TIME) {
        /* F is 1/min: the move takes 60/F s. */
        move->inverse_time_s = (float)(S_PER_MIN / r->block->number[WORD('F')]);
        return;
    }
    move->feed_mm_s = resolve_feed_mm_s(next);
    /* F counts degrees when none of XYZ moves; degrees have no inches. A full circle moves. */
    if (next->inches && !is_arc && is_position(r, move->target_mm, AXIS_A))
        move->feed_mm_s = (float)(move->feed_mm_s / r->unit_mm);
}

/* G1 G2 G3 G38; the target is known. */
static enum status feed_move(struct resolver *r) {
    struct gcode_move *move = &r->out->move;

    set_feed(r);
    switch (r->out->next.motion) {
    case MOTION_ARC_CW:
    case MOTION_ARC_CCW:
        return resolve_arc(r);
    case MOTION_PROBE: /* one that leads nowhere is refused, as in Grbl: nothing could trigger */
        move->probe = r->out->next.probe;
        return is_position(r, move->target_mm, AXIS_COUNT) ? STATUS_BAD_TARGET : STATUS_OK;
    case MOTION_CUBIC:
    case MOTION_QUADRATIC:
        return resolve_spline(r);
    case MOTION_CYCLE:
    case MOTION_THREAD:
    case MOTION_LINEAR:
    case MOTION_RAPID:
    case MOTION_NONE:
        break;
    }
    return STATUS_OK;
}

/* In G95 a feed is nothing without a turning spindle. */
static bool lacks_spindle(const struct resolver *r) {
    const struct gcode_modal *next = &r->out->next;

    return next->feed_mode == FEED_PER_REV && (next->spindle == SPINDLE_OFF || next->spindle_rpm <= 0.0f);
}

static bool has_feed(const struct resolver *r) {
    return r->out->next.feed_mode == FEED_INVERSE_TIME ? r->block->number[WORD('F')] > 0.0
                                                       : r->out->next.feed_mm_s > 0.0f;
}

/* An arc without axis words: all round its centre. */
static bool is_circle(const struct resolver *r) {
    const enum gcode_motion motion = r->out->next.motion;

    return (motion == MOTION_ARC_CW || motion == MOTION_ARC_CCW) && (r->unused & WORDS_CENTER) != 0;
}

enum status resolve_move(struct resolver *r) {
    const enum gcode_motion motion = r->out->next.motion;
    struct gcode_move *move = &r->out->move;
    enum status status;

    if (r->nonmodal == NONMODAL_MACHINE_COORDS && motion != MOTION_RAPID && motion != MOTION_LINEAR)
        return STATUS_G53_MOTION;
    if (motion == MOTION_NONE && r->axes == AXES_MOTION && r->axis_words != 0)
        return STATUS_AXIS_WORDS_UNUSED;
    if (r->nonmodal == NONMODAL_G28)
        return home_move(r, r->state->offsets.g28_mm);
    if (r->nonmodal == NONMODAL_G30)
        return home_move(r, r->state->offsets.g30_mm);
    if (r->axes != AXES_MOTION)
        return STATUS_OK;
    if (motion == MOTION_THREAD)
        return resolve_thread(r);
    if (motion != MOTION_RAPID && !has_feed(r))
        return STATUS_NO_FEED;
    if (motion != MOTION_RAPID && lacks_spindle(r))
        return STATUS_SPINDLE_OFF;
    if (r->axis_words == 0 && !is_circle(r))
        return motion == MOTION_RAPID || motion == MOTION_LINEAR ? STATUS_OK : STATUS_NO_AXIS_WORDS;

    move->motion = motion;
    if (motion == MOTION_CYCLE)
        return resolve_cycle(r);
    status = resolve_target(r, move->target_mm);
    if (status == STATUS_OK && motion != MOTION_RAPID)
        status = feed_move(r);
    return status;
}
