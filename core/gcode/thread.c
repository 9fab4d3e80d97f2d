/* SPDX-License-Identifier: MIT */
#include "gcode/thread.h"

#include "base/power.h"

#include <string.h> // memcpy

/* Depth of a pass, and no more than the full one. */
static double pass_depth_mm(const struct gcode_thread *thread, uint32_t pass) {
    double depth_mm =
        (double)thread->first_mm * power_raise((double)(pass + 1), 1.0 / (double)thread->degression);
    return depth_mm < (double)thread->depth_mm ? depth_mm : (double)thread->depth_mm;
}

uint32_t thread_pass_count(const struct gcode_thread *thread) {
    uint32_t count = 0;

    while (count <= THREAD_PASSES_MAX && pass_depth_mm(thread, count) < (double)thread->depth_mm)
        count++;
    count += 1u + thread->springs;
    return count <= THREAD_PASSES_MAX ? count : THREAD_PASSES_MAX + 1u;
}

void thread_begin(struct thread *thread, const double start_mm[AXIS_COUNT], const struct gcode_move *move) {
    thread->thread = move->thread;
    memcpy(thread->start_mm, start_mm, sizeof thread->start_mm);
    memcpy(thread->at_mm, start_mm, sizeof thread->at_mm);
    thread->end_z_mm = move->target_mm[AXIS_Z];
    thread->pass = 0;
    thread->step = 1;
}

/* How far the pass lies before its place at full depth, along Z. */
static double before_mm(const struct thread *thread, double depth_mm) {
    const double left_mm = ((double)thread->thread.depth_mm - depth_mm) * (double)thread->thread.slide;
    return thread->end_z_mm < thread->start_mm[AXIS_Z] ? left_mm : -left_mm;
}

bool thread_next(struct thread *thread, struct thread_action *action) {
    const struct gcode_thread *spec = &thread->thread;
    const double depth_mm = pass_depth_mm(spec, thread->pass);
    const double drive_x_mm = thread->start_mm[AXIS_X];
    const double deep_x_mm = drive_x_mm + thread_depth_x_mm(spec, depth_mm);
    const double peak_x_mm = drive_x_mm + (double)spec->peak_mm;
    double *at = thread->at_mm;

    if (thread->step == 1 && thread->pass == thread_pass_count(spec))
        return false;
    action->kind = THREAD_RAPID;
    action->depth_mm = 0.0;
    switch (thread->step) {
    case 1:
        at[AXIS_Z] = thread->start_mm[AXIS_Z] + before_mm(thread, depth_mm);
        break;
    case 2:
        at[AXIS_X] = spec->entry ? peak_x_mm : deep_x_mm;
        break;
    case 3:
        action->kind = THREAD_PASS;
        action->depth_mm = deep_x_mm - peak_x_mm;
        at[AXIS_Z] = thread->end_z_mm + before_mm(thread, depth_mm);
        at[AXIS_X] = spec->exit ? peak_x_mm : deep_x_mm;
        break;
    default:
        at[AXIS_X] = drive_x_mm;
        thread->pass++;
        break;
    }
    thread->step = (uint8_t)(thread->step % 4 + 1);
    memcpy(action->target_mm, at, sizeof action->target_mm);
    return true;
}
