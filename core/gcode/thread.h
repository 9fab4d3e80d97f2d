/* SPDX-License-Identifier: MIT
 * The threading cycle G76 as a stream of rapids and passes. [task] Resumable: the caller takes the next
 * action when it has done the last.
 *
 *            X ^  drive line   1 ------------------------------ 4      1 -> 2  rapid to the depth of the pass
 *              |                                                       2 -> 3  follows the spindle
 *              |                                                       3 -> 4 -> 1  rapids
 *              |               2 ------------------------------ 3
 *              +--------------------------------------> Z
 *
 * A pass begins depth * slide ahead of the start and ends (depth left) * slide before the end, so that its
 * tool works more with its leading edge; the last one ends at the end of the drive line, and there the tool
 * stays. A taper is as high as the full depth in every pass: one that is not at full depth yet begins or ends
 * off the work by what is left.
 *
 * Pass n of the cycle is first * n^(1/R) deep: R = 1 all cuts equally deep, R = 2 equally large. */
#ifndef WIFICNC_GCODE_THREAD_H
#define WIFICNC_GCODE_THREAD_H

#include "gcode/gcode.h"

enum thread_action_kind { THREAD_RAPID, THREAD_PASS };

struct thread_action {
    enum thread_action_kind kind;
    double target_mm[AXIS_COUNT]; /* machine coordinates */
    double depth_mm;              /* of a pass: height of its tapers, signed along X */
};

struct thread {
    struct gcode_thread thread;
    double start_mm[AXIS_COUNT]; /* the drive line's */
    double end_z_mm;
    double at_mm[AXIS_COUNT];
    uint32_t passes, pass; /* of the cycle; the present one, from 0 */
    uint8_t step;          /* of the pass: 1 .. 4 as above */
};

/** Passes of a cycle, springs too; THREAD_PASSES_MAX + 1: more than that. */
uint32_t thread_pass_count(const struct gcode_thread *thread);

/** X of this depth from the drive line, signed. */
static inline double thread_depth_x_mm(const struct gcode_thread *thread, double depth_mm) {
    return (double)thread->peak_mm + (thread->peak_mm < 0.0f ? -depth_mm : depth_mm);
}

/** Start at start_mm with a resolved G76. */
void thread_begin(struct thread *thread, const double start_mm[AXIS_COUNT], const struct gcode_move *move);

/** Next action. @return false when all are done; the tool then is at move->target_mm. */
bool thread_next(struct thread *thread, struct thread_action *action);

/** A pass was the newest action: the next one withdraws the tool. */
static inline bool thread_withdraws(const struct thread *thread) {
    return thread->step == 4;
}

#endif
