/* SPDX-License-Identifier: MIT
 * Spans of time to be waited for. [task] */
#ifndef WIFICNC_MACHINE_TIMER_H
#define WIFICNC_MACHINE_TIMER_H

#include "machine/machine.h"

/** A span of time to be waited for. */
struct machine_timer {
    bool on;
    uint32_t from_us, us;
};

/** Spans of time that are under way. */
struct machine_clock {
    struct machine_timer quiet; /* after an alarm */
    struct machine_timer timer; /* of the activity: debounce, spindle run-up */
};

/** No quiet any more: someone has unlocked the machine. */
static inline void timer_end_quiet(struct machine_clock *clock) {
    clock->quiet.on = false;
}

/** Spans that are over are off before the clock wraps. @return true while nothing may be said or read after
 * an alarm */
bool timer_poll(struct machine *machine);

/** @param us  0: it does not run */
void timer_start(const struct machine *machine, struct machine_timer *timer, uint32_t us);

/** It was started and is not over. */
bool timer_runs(const struct machine *machine, const struct machine_timer *timer);

/** Until the timer is over; UINT32_MAX: it does not run. */
uint32_t timer_left_us(const struct machine *machine, const struct machine_timer *timer);

#endif
