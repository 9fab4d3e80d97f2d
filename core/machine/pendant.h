/* SPDX-License-Identifier: MIT
 * A pendant next to the sender: when its lines would be read, and that it is in control. [task] */
#ifndef WIFICNC_MACHINE_PENDANT_H
#define WIFICNC_MACHINE_PENDANT_H

#include "machine/machine.h"

/** Whether a line that comes now would be read. */
enum machine_reads {
    MACHINE_READS_NOTHING,  /* a job, a jog or a homing cycle is under way, or held */
    MACHINE_READS_SOON,     /* at rest or parked, with a line that is not answered yet */
    MACHINE_READS_LINES,    /* at rest, and no line waits */
    MACHINE_READS_OPERATORS /* a job is held and parked (park.h): lines are the operator's */
};

enum machine_reads machine_reads(const struct machine *machine);

/** The pendant whose line was read last is gone: its jog ends; anything else of it is a lost sender's. */
void machine_pendant_lost(struct machine *machine);

/** A pendant has control, or not any more: reports say `MPG:1` or `MPG:0`, as grblHAL's. */
void machine_set_mpg(struct machine *machine, bool on);

#endif
