/* SPDX-License-Identifier: MIT
 * Several hands at one machine: when lines of a pendant would be read, and that it is in control; of whom
 * lines are. [task] */
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

/** Of whom lines are that come now: between 0xA3 and ~ they are the operator's (park.h). */
enum machine_whose {
    MACHINE_WHOSE_NONE,  /* lines are the job's */
    MACHINE_WHOSE_TOOL,  /* the same; but behind an M6 ($341) $J= needs no 0xA3 (lines.c) */
    MACHINE_WHOSE_ASKED, /* the operator's, as soon as the axes rest */
    MACHINE_WHOSE_OPEN,  /* the operator's, and they are read */
    MACHINE_WHOSE_SHUT   /* the operator's; behind a door none is read */
};

enum machine_whose machine_whose(const struct machine *machine);

/** Holds, jog cancels and doors so far, wraps: a ~ from before one counts no more. */
uint8_t machine_stops(const struct machine *machine);

/** Bytes that its receive buffer would take. */
size_t machine_line_room(const struct machine *machine);

/** Another client has taken control: the job's lines that have not begun are dropped. That which is under way
 * stays, and is answered when it is done. In the task that puts the lines.
 * @return lines dropped */
uint32_t machine_drop_unread(struct machine *machine);

/** The pendant whose line was read last is gone: its jog ends; anything else of it is a lost sender's. */
void machine_pendant_lost(struct machine *machine);

/** A pendant has control, or not any more: reports say `MPG:1` or `MPG:0`, as grblHAL's. */
void machine_set_mpg(struct machine *machine, bool on);

#endif
