/* SPDX-License-Identifier: MIT
 * G33, G33.1, G76: motion that follows the spindle, as LinuxCNC documents it. */
#include "gcode/arc.h"
#include "gcode/resolve.h"
#include "gcode/thread.h"

#include "base/trig.h"

#include <math.h>   // fabs: exact
#include <string.h> // memcpy

#define SLIDE_MAX_DEG   80.0 /* its tangent still is a length of threads */
#define RETURN_MAX      100.0
#define SPRINGS_MAX     100.0
#define RADIANS_PER_DEG 0.017453292519943295

/* A word that must be there and above 0. */
static enum status take_positive(struct resolver *r, char letter, double unit_mm, float *out) {
    double number;

    if (!resolve_take(r, letter, &number))
        return STATUS_VALUE_MISSING;
    if (number < 0.0)
        return STATUS_NEGATIVE;
    *out = (float)(number * unit_mm);
    return *out > 0.0f && gcode_in_range(AXIS_Z, number * unit_mm) ? STATUS_OK : STATUS_BAD_NUMBER;
}

static enum status line_or_tap(struct resolver *r) {
    struct gcode_move *move = &r->out->move;
    double times = 1.0, way = 0.0;
    enum status status = take_positive(r, 'K', r->unit_mm, &move->thread.pitch_mm);

    if (status == STATUS_OK)
        status = resolve_target(r, move->via_mm);
    if (status != STATUS_OK)
        return status;
    for (unsigned axis = 0; axis < AXIS_A; axis++)
        way += fabs(move->via_mm[axis] - r->state->position_mm[axis]);
    if (way <= 0.0)
        return STATUS_BAD_TARGET;
    memcpy(move->target_mm, move->via_mm, sizeof move->target_mm);
    /* A tap comes back to where it started; a line stays at its end. */
    if (move->thread.kind != THREAD_TAP)
        return STATUS_OK;
    memcpy(move->target_mm, r->state->position_mm, sizeof move->target_mm);
    if (resolve_take(r, 'I', &times) && !(times > 0.0 && times <= RETURN_MAX))
        return STATUS_BAD_NUMBER;
    move->thread.return_speed = (float)times;
    return STATUS_OK;
}

/* P Z I J K, which must be there. Depths are diameters in G7. */
static enum status take_sizes(struct resolver *r) {
    struct gcode_thread *thread = &r->out->move.thread;
    const double depth_mm = r->unit_mm * (r->out->next.diameter ? 0.5 : 1.0);
    double peak;
    enum status status = take_positive(r, 'P', r->unit_mm, &thread->pitch_mm);

    if (status == STATUS_OK)
        status = take_positive(r, 'J', depth_mm, &thread->first_mm);
    if (status == STATUS_OK)
        status = take_positive(r, 'K', depth_mm, &thread->depth_mm);
    if (status != STATUS_OK)
        return status;
    if (!resolve_take(r, 'I', &peak) || (r->axis_words & 1u << AXIS_Z) == 0)
        return STATUS_VALUE_MISSING;
    if (thread->first_mm >= thread->depth_mm)
        return STATUS_BAD_NUMBER;
    thread->peak_mm = (float)(peak * depth_mm);
    return peak != 0.0 && gcode_in_range(AXIS_X, peak * depth_mm) ? STATUS_OK : STATUS_BAD_NUMBER;
}

/* R Q H, which need not. */
static enum status take_passes(struct resolver *r) {
    struct gcode_thread *thread = &r->out->move.thread;
    double degression = 1.0, slide_deg = 0.0, springs = 0.0, sine, cosine;

    resolve_take(r, 'R', &degression);
    resolve_take(r, 'Q', &slide_deg);
    resolve_take(r, 'H', &springs);
    if (degression < 1.0 || slide_deg > SLIDE_MAX_DEG || springs > SPRINGS_MAX)
        return STATUS_BAD_NUMBER;
    thread->degression = (float)degression;
    trig_sincos(slide_deg * RADIANS_PER_DEG, &sine, &cosine);
    thread->slide = (float)(sine / cosine);
    thread->springs = (uint16_t)springs;
    if (springs != (double)thread->springs)
        return STATUS_NOT_INTEGER;
    return thread_pass_count(thread) <= THREAD_PASSES_MAX ? STATUS_OK : STATUS_BAD_NUMBER;
}

/* L E. */
static enum status take_tapers(struct resolver *r, double way_mm) {
    struct gcode_thread *thread = &r->out->move.thread;
    double ends = 0.0, taper = 0.0;

    resolve_take(r, 'L', &ends);
    resolve_take(r, 'E', &taper);
    if (ends != 0.0 && ends != 1.0 && ends != 2.0 && ends != 3.0)
        return STATUS_BAD_NUMBER;
    thread->entry = ((unsigned)ends & 1u) != 0;
    thread->exit = ((unsigned)ends & 2u) != 0;
    thread->taper_mm = (float)(taper * r->unit_mm);
    if (taper < 0.0)
        return STATUS_NEGATIVE;
    return (ends == 0.0 || taper > 0.0) && taper * r->unit_mm <= 0.5 * way_mm ? STATUS_OK : STATUS_BAD_NUMBER;
}

static enum status cycle(struct resolver *r) {
    struct gcode_move *move = &r->out->move;
    double way_mm = 0.0;
    enum status status;

    if (r->out->next.plane != PLANE_ZX)
        return STATUS_THREAD_PLANE;
    if ((r->axis_words & ~(1u << AXIS_Z)) != 0)
        return STATUS_AXIS_WORDS_UNUSED;
    status = take_sizes(r);
    if (status == STATUS_OK)
        status = resolve_target(r, move->target_mm);
    if (status == STATUS_OK)
        status = take_passes(r);
    if (status == STATUS_OK) {
        way_mm = fabs(move->target_mm[AXIS_Z] - r->state->position_mm[AXIS_Z]);
        status = take_tapers(r, way_mm);
    }
    if (status != STATUS_OK)
        return status;
    if (way_mm == 0.0)
        return STATUS_BAD_TARGET;
    /* The compound slide moves the start of the deepest pass along the thread; something must be left of
     * it. */
    if ((double)(move->thread.slide * move->thread.depth_mm) >= way_mm)
        return STATUS_BAD_NUMBER;
    memcpy(move->via_mm, move->target_mm, sizeof move->via_mm);
    move->via_mm[AXIS_X] += thread_depth_x_mm(&move->thread, (double)move->thread.depth_mm);
    return gcode_in_range(AXIS_X, move->via_mm[AXIS_X]) ? STATUS_OK : STATUS_BAD_TARGET;
}

enum status resolve_thread(struct resolver *r) {
    const struct gcode_modal *next = &r->out->next;
    struct gcode_move *move = &r->out->move;

    if (!WITH_ENCODER || !r->state->ports.encoder)
        return STATUS_NO_ENCODER;
    if (r->axis_words == 0)
        return STATUS_NO_AXIS_WORDS;
    if (r->axis_words >> AXIS_A != 0)
        return STATUS_AXIS_WORDS_UNUSED;
    if (next->spindle == SPINDLE_OFF || next->spindle_rpm <= 0.0f)
        return STATUS_SPINDLE_OFF;
    if (next->cycle == THREAD_TAP && r->state->ports.no_reverse)
        return STATUS_NO_OUTPUT; /* the spindle could not turn back */
    r->out->sticky = r->state->sticky;
    move->motion = MOTION_THREAD;
    move->thread = (struct gcode_thread){.kind = (enum gcode_thread_kind)next->cycle};
    return move->thread.kind == THREAD_CYCLE ? cycle(r) : line_or_tap(r);
}
