/* SPDX-License-Identifier: MIT
 * The threading cycle G76 as a stream of rapids and passes. [task] Resumable: the caller takes the next
 * action when it has done the last.
 *
 *            X ^  drive line   1 ------------------------------ 4      1 -> 2  rapid to the depth of the pass
 *              |               |                                |             (to the peak, if it has a taper
 *              |          peak 2' . . . . . . . . . . . . . . .                at the entry: 2')
 *              |               2 ------------------------------ 3      2 -> 3  follows the spindle
 *              +--------------------------------------> Z              3 -> 4 -> 1  rapids
 *
 * Drawn for a thread inside. A pass that is not at full depth yet lies (depth left) * slide before, at both
 * ends, so that its tool works more with its leading edge. The last pass ends at 4, and there the tool stays.
 *
 * Pass n of the cycle is first * n^(1/R) deep: R = 1 all cuts equally deep, R = 2 equally large. */
#ifndef WIFICNC_GCODE_THREAD_H
#define WIFICNC_GCODE_THREAD_H

#include "gcode/gcode.h"

enum thread_action_kind { THREAD_RAPID, THREAD_PASS };

struct thread_action {
    enum thread_action_kind kind;
    double target_mm[AXIS_COUNT]; /* machine coordinates; of a pass with a taper at the exit: on the peak */
    double depth_mm;              /* of a pass: signed along X, from the peak */
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
