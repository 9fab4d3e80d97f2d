/* SPDX-License-Identifier: MIT
 * $J=: moves that can be called off. [task] */
#ifndef WIFICNC_MACHINE_JOG_H
#define WIFICNC_MACHINE_JOG_H

#include "gcode/status.h"
#include "machine/machine.h"

#include <stdbool.h>
#include <stdint.h>

enum jog_lock {
    JOG_LOCK_OFF,
    JOG_LOCK_ON,  /* machine_stopped_by_other(): jogs that follow are refused */
    JOG_LOCK_TOLD /* ... and one was, with the reason */
};

/** Of all who jog. */
struct machine_jogs {
    uint32_t asked_us; /* hal_time_us() when the newest was asked for, or stopped */
    bool asked;        /* one was, since the start */
    bool tells;        /* one that moved was stopped by another: the reason is reported at rest */
    enum jog_lock lock;
};

/** Ask it once for each jog that comes. @return true: it follows one that was stopped by another
 * (machine_stopped_by_other()) */
bool jog_is_locked(struct machine *machine);

/** A single step sends nothing after its stop: report the reason when the machine is at rest.
 * @return true: it did */
bool jog_tell_stopped(struct machine *machine);

/** $J= with this text. @return STATUS_OK: it is a task now */
enum status jog_begin(struct machine *machine, const char *text);

/** A jog of no line: a straight move to there, or with $56 to where the travel ends, in
 * machine->task.command. @param feed  mm/s @return false: it may not, or it leads nowhere */
bool jog_aim(struct machine *machine, const double target_mm[AXIS_COUNT], float feed);

/** @return TASK_NONE when it is planned */
enum task_stage jog_poll(struct machine *machine);

/** Slow down, and forget all jogs; jog_end_cancel() when it is at rest. */
void jog_cancel(struct machine *machine);

/** It is at rest. */
void jog_end_cancel(struct machine *machine);

#endif
