/* SPDX-License-Identifier: MIT */
#include "serve_clock.h"

#include "port.h"

/* A program that was stopped (a laptop asleep, a debugger) does not make up for the time: virtual time
 * slips. */
#define MAX_BEHIND_NS 250000000.0

void serve_clock_start(struct serve_clock *clock, double ticks_per_s, uint64_t ticks) {
    *clock = (struct serve_clock){
        .base_ns = port_clock_ns(), .base_ticks = ticks, .ticks_per_ns = ticks_per_s * 1e-9};
}

uint64_t serve_clock_ticks(struct serve_clock *clock, uint64_t done_ticks) {
    uint64_t now_ns = port_clock_ns();
    /* a double holds 2^53: at 100 MHz, years to the tick */
    uint64_t ticks = clock->base_ticks + (uint64_t)((double)(now_ns - clock->base_ns) * clock->ticks_per_ns);
    if (ticks < done_ticks)
        return done_ticks;
    if ((double)(ticks - done_ticks) <= MAX_BEHIND_NS * clock->ticks_per_ns)
        return ticks;
    clock->slips++;
    clock->base_ns = now_ns;
    clock->base_ticks = done_ticks;
    return done_ticks;
}
