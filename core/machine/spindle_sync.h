/* SPDX-License-Identifier: MIT
 * Motion that follows the spindle: G33, G33.1 and the passes of G76 (motion/gear.h), and feed per
 * revolution, G95. A hold or an open door waits until the tool is out of the work; what cannot wait (e-stop,
 * reset) does not. A spindle that does not do what was commanded is an alarm, never a wait without end.
 * [task] */
#ifndef WIFICNC_MACHINE_SPINDLE_SYNC_H
#define WIFICNC_MACHINE_SPINDLE_SYNC_H

#include "gcode/thread.h"
#include "machine/machine.h"
#include "machine/timer.h"

/** Where a pass that follows the spindle is; machine/spindle_sync.c. */
enum thread_step {
    THREAD_NEXT,     /* find the next thing to do */
    THREAD_PASSING,  /* a pass is under way */
    THREAD_OUT,      /* a tap: the spindle was commanded to turn back */
    THREAD_TURNING,  /* it has come back and was commanded to turn as before */
    THREAD_STANDING, /* its axes come to rest */
    THREAD_BACK,     /* it returns to where it began */
};

/** Motion that follows the spindle, and feed per revolution. */
struct machine_spindle_sync {
    enum thread_step step;
    struct thread cycle;         /* G76 */
    struct thread_action action; /* of it, waits while action_pending */
    bool action_pending;
    bool cutting;     /* the tool is in the work: holds and the door wait */
    bool door_waits;  /* 0x84 came meanwhile */
    bool again;       /* a hold came before the pass had begun */
    enum alarm fault; /* to be reported when all is at rest */
    struct machine_timer patience;
    float per_rev_nominal; /* G95: revolutions/s that feeds were planned with; 0: G93, G94 */
    float per_rev_factor;  /* real speed / that */
};

/** The door opens when the tool is out of the work. */
static inline void spindle_sync_keep_door(struct machine_spindle_sync *thread) {
    thread->door_waits = true;
}

/** The spindle can be followed at this speed: STATUS_OK or STATUS_SPINDLE_TOO_FAST. */
enum status spindle_sync_check(const struct machine *machine, const struct gcode_command *command);

/** The pass or the cycle of the present line begins. */
void spindle_sync_start(struct machine *machine);

/** @return TASK_NONE when the move is done */
enum task_stage spindle_sync_poll(struct machine *machine);

/** A motion of the current line begins: is its feed per revolution? */
void spindle_sync_note_feed(struct machine *machine);

/** Look at the encoder. */
void spindle_sync_watch(struct machine *machine);

/** A hold or an open door comes now: it must wait until the tool is out of the work. */
bool spindle_sync_defers(struct machine *machine);

/** What was under way is given up. */
static inline void spindle_sync_forget(struct machine_spindle_sync *thread) {
    thread->cutting = thread->door_waits = thread->action_pending = thread->again = false;
    thread->per_rev_nominal = 0.0f;
    thread->fault = ALARM_NONE;
}

#endif
