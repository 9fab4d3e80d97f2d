/* SPDX-License-Identifier: MIT
 * A spindle needs time to come to speed and to stop: $394, $539, and with an encoder $340. Whoever switches
 * it on waits here: the program (task.c, drill.c), and the return from a hold, a door or a remote host.
 * [task] */
#ifndef WIFICNC_MACHINE_RUN_UP_H
#define WIFICNC_MACHINE_RUN_UP_H

#include "gcode/gcode.h"
#include "machine/machine.h"
#include "machine/timer.h"

/** Grbl's pause before a job continues behind a closed door. */
#define RUN_UP_DOOR_US 4000000u

/** For the measured speed, beyond $394: as long as a thread waits for it. */
#define RUN_UP_PATIENCE_US 10000000u

/** How the spindle was switched last, and what nothing has waited for yet. */
struct machine_run_up {
    int8_t direction;           /* as it is put out: 1 clockwise, -1 counterclockwise, 0 off */
    int8_t coasting;            /* where it turned before that */
    bool due;                   /* nothing has waited for the newest change */
    bool checks;                /* the return waits for the measured speed, too */
    float rpm;                  /* S of the newest change */
    float waited_rpm;           /* S of the newest change that needs the delay */
    struct machine_timer turns; /* $394 */
    struct machine_timer stops; /* $539 */
    struct machine_timer near;  /* the measured speed has been within $340 since its start */
    struct machine_timer wait;  /* of the return */
};

enum run_up_state {
    RUN_UP_WAITS,
    RUN_UP_DONE,
    RUN_UP_MISSED, /* it has not come to speed */
};

/** What is put out now; a laser needs no time. @param rpm  S, without override */
void run_up_note(struct machine *machine, int direction, float rpm);

/** What remains of $539 before the spindle may be switched so; SPINDLE_OFF: until it is still. */
uint32_t run_up_stop_us(const struct machine *machine, enum gcode_spindle next);

/** What the newest change of the spindle needs.
 *  @param checks  then the measured speed counts, and this may take RUN_UP_PATIENCE_US more
 *  @return us of delay */
uint32_t run_up_due_us(const struct machine *machine, bool *checks);

/** From here on the program waits for it. */
static inline void run_up_take(struct machine_run_up *run_up) {
    run_up->due = false;
}

/** Of a wait that checks the speed. @param left_us  of delay and patience together */
enum run_up_state run_up_look(const struct machine *machine, uint32_t left_us);

/** RUN_UP_MISSED, in numbers; ALARM_SPINDLE follows. */
void run_up_report_miss(struct machine *machine);

/** Speed of the spindle, signed. @return false: nothing measures it */
bool run_up_measured_rpm(const struct machine *machine, float *rpm);

/** The return waits. @param least_us  where no setting says how long */
void run_up_return(struct machine *machine, uint32_t least_us);

/** A reset or an alarm: the wait ends. */
static inline void run_up_forget(struct machine_run_up *run_up) {
    run_up->due = run_up->checks = run_up->wait.on = false;
}

/** Is the return's wait over? */
enum run_up_state run_up_poll(struct machine *machine);

/** Is the measured speed, just read, that of S? And spans that are over are off before the clock wraps. */
void run_up_tend(struct machine *machine);

/** Poll again after this time; UINT32_MAX: nothing waits. */
uint32_t run_up_wait_us(const struct machine *machine);

#endif
