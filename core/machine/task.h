/* SPDX-License-Identifier: MIT
 * The stages of one accepted G-code line. [task] */
#ifndef WIFICNC_MACHINE_TASK_H
#define WIFICNC_MACHINE_TASK_H

#include "gcode/arc.h"
#include "gcode/cycle.h"
#include "gcode/gcode.h"
#include "gcode/spline.h"
#include "machine/machine.h"
#include "machine/tool_notes.h"

#include <string.h>

/** Where the current line is; each stage ends before the next begins. */
enum task_stage {
    TASK_NONE,
    TASK_TOOL,      /* M6: wait for rest */
    TASK_TOOL_WAIT, /* M6: wait for ~ */
    TASK_OUTPUTS,   /* spindle, coolant and what else waits for rest */
    TASK_INPUT,     /* M66: wait for rest */
    TASK_DWELL,
    TASK_DWELLING, /* and M66 while it waits for its input */
    TASK_STORE,
    TASK_VIA, /* first leg of G28, G30 */
    TASK_MOVE,
    TASK_ARC, /* and splines */
    TASK_CYCLE,
    TASK_THREAD, /* motion that follows the spindle */
    TASK_FLOW,   /* M0, M2, M30: wait for rest */
    TASK_PAUSED, /* M0: wait for ~ */
    TASK_JOG,    /* $J=: wait for room */
    TASK_PROBE,  /* wait for rest, then look at the probe */
    TASK_PROBING,
    TASK_PROBED,     /* say where; after an alarm when its quiet time is over */
    TASK_ALARMED,    /* answer when the quiet time is over */
    TASK_SOFT_LIMIT, /* wait for the stop, then alarm 2 */
    TASK_HOMING,
    TASK_TOOL_MOTION, /* $341, $TPW: tool_change.c */
    TASK_LOCKED,      /* a critical alarm has ended the line; answered when its quiet time is over */
    TASK_STAGE_COUNT
};

/** What can end a dwell before its time. */
enum task_await {
    AWAIT_NOTHING,
    AWAIT_INPUT,   /* M66 */
    AWAIT_SPINDLE, /* $340; its time is the most that this may take */
};

/** The current line. */
struct machine_task {
    enum task_stage stage;
    bool further;                 /* within this stage: carry it on again before anything else waits */
    struct gcode_command command; /* of the current line */
    double dwell_left_s;
    enum task_await awaits; /* the dwell ends with it */
    bool input_before;      /* level of M66's input when it was last read: it may wait for an edge */
    enum task_stage after_dwell;
    bool arc_pending; /* arc_point_mm waits for room in the look-ahead */
    double arc_point_mm[AXIS_COUNT];
    float arc_feed_mm_s;
    bool action_pending;
    struct cycle_action action; /* of the cycle, waits while action_pending */
    union {                     /* of the curve, the cycle or the G10 that the line is */
        struct {
            bool is_given;
            char text[TOOL_TEXT_SIZE];
        } note; /* the comment of G10 L1 */
        struct arc arc;
        struct spline spline;
        struct cycle cycle;
    };
};

/** The present line continues with this stage. */
static inline void task_enter(struct machine_task *task, enum task_stage stage) {
    task->stage = stage;
}

/** The stage came further and is the same as before. */
static inline void task_note_further(struct machine_task *task) {
    task->further = true;
}

/** There is no present line. */
static inline void task_forget(struct machine_task *task) {
    task->stage = TASK_NONE;
    task->arc_pending = false;
    task->awaits = AWAIT_NOTHING;
}

/** The present line waits in `aside`, and others may come. */
static inline void task_put_aside(struct machine_task *task, struct machine_task *aside) {
    memcpy(aside, task, sizeof *aside);
    task_forget(task);
}

/** It continues. */
static inline void task_take_back(struct machine_task *task, const struct machine_task *aside) {
    memcpy(task, aside, sizeof *task);
}

/** Work zero has moved before it continues. */
void task_shift(struct machine_task *task, const double shift_mm[AXIS_COUNT]);

/** Start the stages of machine->task.command. */
void task_begin(struct machine *machine);

/** Carry the current line on. @return true when it came further. */
bool task_poll(struct machine *machine);

#endif
