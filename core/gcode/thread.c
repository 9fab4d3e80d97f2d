/* SPDX-License-Identifier: MIT */
#include "gcode/thread.h"

#include "base/pow.h"

#include <math.h>   // ceil
#include <string.h> // memcpy

#define ROUNDING 1e-6 /* of a number of cuts: sizes are floats */

/* Passes that get deeper, from first * n^(1/R) >= depth; more than there may be: as many as that or more. */
static uint32_t cut_count(const struct gcode_thread *thread) {
    const double ratio = (double)thread->depth_mm / (double)thread->first_mm;
    const double cuts = ratio > 1.0 ? power_raise(ratio, (double)thread->degression) : 1.0;

    return cuts <= (double)THREAD_PASSES_MAX ? (uint32_t)ceil(cuts * (1.0 - ROUNDING))
                                             : THREAD_PASSES_MAX + 1u;
}

uint32_t thread_pass_count(const struct gcode_thread *thread) {
    const uint32_t count = cut_count(thread) + thread->springs;
    return count <= THREAD_PASSES_MAX ? count : THREAD_PASSES_MAX + 1u;
}

/* The last cut takes what is left, and springs take nothing. */
static double pass_depth_mm(const struct thread *thread) {
    const struct gcode_thread *spec = &thread->thread;

    if (thread->pass + 1u + spec->springs >= thread->passes)
        return (double)spec->depth_mm;
    return (double)spec->first_mm * power_raise((double)(thread->pass + 1u), 1.0 / (double)spec->degression);
}

void thread_begin(struct thread *thread, const double start_mm[AXIS_COUNT], const struct gcode_move *move) {
    thread->thread = move->thread;
    memcpy(thread->start_mm, start_mm, sizeof thread->start_mm);
    memcpy(thread->at_mm, start_mm, sizeof thread->at_mm);
    thread->end_z_mm = move->target_mm[AXIS_Z];
    thread->passes = thread_pass_count(&move->thread);
    thread->pass = 0;
    thread->step = 1;
}

/* X of this depth, signed, from the drive line. */
static double x_mm(const struct thread *thread, double depth_mm) {
    return thread->start_mm[AXIS_X] + thread_depth_x_mm(&thread->thread, depth_mm);
}

/* Where the pass begins: ahead by depth * slide; and where it ends, which leaves the rest of that. */
static double begin_z_mm(const struct thread *thread, double depth_mm) {
    const double ahead_mm = depth_mm * (double)thread->thread.slide;
    return thread->start_mm[AXIS_Z] + (thread->end_z_mm < thread->start_mm[AXIS_Z] ? -ahead_mm : ahead_mm);
}

static double end_z_mm(const struct thread *thread, double depth_mm) {
    const double left_mm = ((double)thread->thread.depth_mm - depth_mm) * (double)thread->thread.slide;
    return thread->end_z_mm + (thread->end_z_mm < thread->start_mm[AXIS_Z] ? left_mm : -left_mm);
}

bool thread_next(struct thread *thread, struct thread_action *action) {
    const struct gcode_thread *spec = &thread->thread;
    const double depth_mm = pass_depth_mm(thread);
    const double deep_x_mm = x_mm(thread, depth_mm);
    const double end_x_mm = x_mm(thread, depth_mm - (double)spec->depth_mm); /* of a taper */
    double *at = thread->at_mm;

    if (thread->step == 1 && thread->pass == thread->passes)
        return false;
    action->kind = THREAD_RAPID;
    action->depth_mm = 0.0;
    switch (thread->step) {
    case 1:
        at[AXIS_Z] = begin_z_mm(thread, depth_mm);
        break;
    case 2:
        at[AXIS_X] = spec->entry ? end_x_mm : deep_x_mm;
        break;
    case 3:
        action->kind = THREAD_PASS;
        action->depth_mm = deep_x_mm - end_x_mm;
        at[AXIS_Z] = end_z_mm(thread, depth_mm);
        at[AXIS_X] = spec->exit ? end_x_mm : deep_x_mm;
        break;
    default:
        at[AXIS_X] = thread->start_mm[AXIS_X];
        thread->pass++;
        break;
    }
    thread->step = (uint8_t)(thread->step % 4 + 1);
    memcpy(action->target_mm, at, sizeof action->target_mm);
    return true;
}
