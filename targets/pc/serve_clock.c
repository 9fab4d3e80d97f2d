/* SPDX-License-Identifier: MIT */
#include "serve_clock.h"

#include "port.h"

/* A program that was stopped (a laptop asleep, a debugger) does not make up for the time: virtual time
 * slips. */
#define MAX_BEHIND_NS 250000000.0

static double ticks_per_ns(const struct serve_clock *clock) {
    return clock->speed * clock->timer_hz * 1e-9;
}

void serve_clock_start(struct serve_clock *clock, double speed, double timer_hz, uint64_t ticks) {
    *clock = (struct serve_clock){
        .base_ns = port_clock_ns(), .base_ticks = ticks, .speed = speed, .timer_hz = timer_hz};
}

void serve_clock_set_speed(struct serve_clock *clock, double speed, uint64_t done_ticks) {
    clock->base_ticks = serve_clock_ticks(clock, done_ticks);
    clock->base_ns = port_clock_ns();
    clock->speed = speed;
}

uint64_t serve_clock_ticks(struct serve_clock *clock, uint64_t done_ticks) {
    uint64_t now_ns = port_clock_ns();
    /* a double holds 2^53: at 100 MHz, years to the tick */
    uint64_t ticks = clock->base_ticks + (uint64_t)((double)(now_ns - clock->base_ns) * ticks_per_ns(clock));
    if (ticks < done_ticks)
        return done_ticks;
    if ((double)(ticks - done_ticks) <= MAX_BEHIND_NS * ticks_per_ns(clock))
        return ticks;
    clock->slips++;
    clock->base_ns = now_ns;
    clock->base_ticks = done_ticks;
    return done_ticks;
}
