/* SPDX-License-Identifier: MIT
 * The dial: a hand wheel that jogs an axis by so much a detent. [task]
 *
 * It moves what a jog may move, and only when the dial turns then: counts that come while the state refuses
 * a jog are dropped, and so are all others until the wheel has rested once. The axis is never farther from
 * where the dial leads it than it needs to stop from $402, v^2 / 2a, or one detent: what is turned faster is
 * dropped, too. */
#ifndef WIFICNC_MACHINE_DIAL_H
#define WIFICNC_MACHINE_DIAL_H

#include "machine/machine.h"
#include "machine/timer.h"

/** A hand that still turns makes counts more often. */
enum { DIAL_REST_US = 250000 };

/** The target supplies it, zeroed, where it has a hal_dial. */
struct machine_dial {
    int32_t counts, base;    /* at the last look; at the newest whole detent */
    uint32_t slips;          /* at the last look */
    double at_mm, before_mm; /* where the axis was at the last look while it moved, and at the one before */
    int32_t wanted;          /* detents that have come and are not planned yet, signed */
    int32_t goal;            /* detents from start_mm to where motion leads */
    int32_t end_steps[AXIS_COUNT];      /* where motion leads, of the motors */
    double start_mm;                    /* where the axis was when the dial began to move it */
    double step_mm;                     /* of one detent */
    uint8_t axis;                       /* of the motion under way */
    bool moves;                         /* motion is the dial's */
    bool pushes;                        /* a move waits for room in the look-ahead */
    bool turns_back;                    /* the axis brakes because the dial has turned back */
    bool locked;                        /* counts are dropped until it has rested */
    struct machine_timer rest;          /* since the last count */
    struct machine_timer gather, quiet; /* before messages, and after them */
    bool gathers, ignored, ends;        /* a message is due; ... and which */
    uint32_t dropped, slipped;          /* for the message */
};

/** Counts from here. After inputs_begin(). */
void dial_begin(struct machine *machine);

/** Take what has been turned, or drop it; at every poll, whatever the machine does. */
void dial_read(struct machine *machine);

/** Plan it. @return true when something was done */
bool dial_poll(struct machine *machine);

/** What it has under way stops or has stopped, and it must rest before it moves anything. */
void dial_stop(struct machine *machine);

/** Motion is the dial's: lines wait until it ends. */
bool dial_moves(const struct machine *machine);

/** Look again after this many us; UINT32_MAX: no need. */
uint32_t dial_wait_us(const struct machine *machine);

#endif
