/* SPDX-License-Identifier: MIT
 * M66: a dwell that an input can end. What it found is #5399. [task] */
#ifndef WIFICNC_MACHINE_AWAIT_H
#define WIFICNC_MACHINE_AWAIT_H

#include "machine/machine.h"

/** It is at rest: take the input as it is, or begin to wait. @param next  the stage behind it */
enum task_stage await_begin(struct machine *machine, enum task_stage next);

/** The awaited input may have come: then the dwell ends. */
void await_poll(struct machine *machine);

#endif
