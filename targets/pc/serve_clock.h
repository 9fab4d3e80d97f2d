/* SPDX-License-Identifier: MIT
 * Virtual time from the wall clock. */
#ifndef WIFICNC_PC_SERVE_CLOCK_H
#define WIFICNC_PC_SERVE_CLOCK_H

#include <stdint.h>

struct serve_clock {
    uint64_t base_ns, base_ticks; /* the same moment */
    double ticks_per_ns;
    uint32_t slips; /* times when the computer was too slow and time was left behind */
};

/** From now on. @param ticks_per_s  of wall time */
void serve_clock_start(struct serve_clock *clock, double ticks_per_s, uint64_t ticks);

/** Virtual time now. A controller that has fallen far behind is not hurried: time continues from where it is.
 *  @param done_ticks  what it has run up to */
uint64_t serve_clock_ticks(struct serve_clock *clock, uint64_t done_ticks);

#endif
