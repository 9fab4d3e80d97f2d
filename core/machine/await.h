/* SPDX-License-Identifier: MIT
 * What a line waits for at rest: an input (M66; what it found is #5399), and what it has switched: coolant
 * and the spindle. [task] */
#ifndef WIFICNC_MACHINE_AWAIT_H
#define WIFICNC_MACHINE_AWAIT_H

#include "machine/machine.h"
#include "machine/outputs.h"
#include "machine/task.h"

/** It is at rest: take the input as it is, or begin to wait. @param next  the stage behind it */
enum task_stage await_begin(struct machine *machine, enum task_stage next);

/** A spindle that turns the other way stops first.
 *  @return the stage that waits for this, then TASK_OUTPUTS again; TASK_NONE: there is nothing to wait for */
enum task_stage await_reversal(struct machine *machine);

/** Spindle and coolant were switched.
 *  @param before  as they were  @param next  the stage behind the wait */
enum task_stage await_outputs(struct machine *machine, const struct machine_outputs *before,
                              enum task_stage next);

/** What is awaited may have come: then the dwell ends. */
void await_poll(struct machine *machine);

#endif
