/* SPDX-License-Identifier: MIT
 * Virtual time from the wall clock. */
#ifndef WIFICNC_PC_SERVE_CLOCK_H
#define WIFICNC_PC_SERVE_CLOCK_H

#include <stdint.h>

struct serve_clock {
    uint64_t base_ns, base_ticks; /* the same moment */
    double speed;                 /* virtual time passes so many times as fast; 0: there is no such clock */
    double timer_hz;              /* ticks in a second of virtual time */
    uint32_t slips;               /* times when the computer was too slow and time was left behind */
};

/** From now on. @param speed  0: as fast as the computer can, so the clock is not read */
void serve_clock_start(struct serve_clock *clock, double speed, double timer_hz, uint64_t ticks);

/** Another speed, above 0, from now on. @param done_ticks  what the controller has run up to */
void serve_clock_set_speed(struct serve_clock *clock, double speed, uint64_t done_ticks);

/** Virtual time now. A controller that has fallen far behind is not hurried: time continues from where it is.
 *  @param done_ticks  what it has run up to */
uint64_t serve_clock_ticks(struct serve_clock *clock, uint64_t done_ticks);

#endif
