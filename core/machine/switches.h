/* SPDX-License-Identifier: MIT
 * Limit and home switches without glitches, $92: a switch is closed when its line has been closed for that
 * long. [isr and motion side] No clock: the target's switch timer says when the time is over.
 *
 * The position that homing measures is that of the edge, not that of the end of the time: so it does not
 * depend on $92. */
#ifndef WIFICNC_MACHINE_SWITCHES_H
#define WIFICNC_MACHINE_SWITCHES_H

#include "hal/hal.h"

#include <stdbool.h>
#include <stdint.h>

/** Lines that are closed, by $5: one byte of each kind, bit n = axis n. */
struct switch_lines {
    uint32_t limits; /* min, max, min and max of the second motors, from the lowest byte */
    uint32_t homes;  /* home, home of the second motors */
};

struct switches {
    struct switch_lines closed;  /* for good; open as soon as the target's debouncing says so */
    struct switch_lines waiting; /* closed, but not long enough yet */
    struct switch_lines due;     /* of those, closed since the timer was started */
    bool timed;                  /* the timer runs */
};

struct switch_lines switch_lines_of(const struct hal_switches *levels, bool active_high);

/** They are as they are; at power-on. */
void switches_begin(struct switches *switches, struct switch_lines stable);

/** A line has changed. @param stable  debounced by the target: on at the first edge
 *  @param pins  at this moment @param filters  $92 is not 0 @return lines that were open and wait now */
struct switch_lines switches_edge(struct switches *switches, struct switch_lines stable,
                                  struct switch_lines pins, bool filters);

/** The timer's time is over, and switches_edge() has seen the pins. @return lines that are closed now */
struct switch_lines switches_time(struct switches *switches);

/** The timer must be started. Call it after the two above. */
bool switches_start_timer(struct switches *switches);

#endif
