/* SPDX-License-Identifier: MIT
 * Spans of time to be waited for. */
#include "machine/timer.h"

#include "machine/parts.h"

void timer_start(const struct machine *machine, struct machine_timer *timer, uint32_t us) {
    *timer = (struct machine_timer){.on = us > 0, .from_us = hal_time_us(machine->hal), .us = us};
}

bool timer_runs(const struct machine *machine, const struct machine_timer *timer) {
    return timer->on && hal_time_us(machine->hal) - timer->from_us < timer->us;
}

uint32_t timer_left_us(const struct machine *machine, const struct machine_timer *timer) {
    if (!timer_runs(machine, timer))
        return UINT32_MAX;
    return timer->us - (hal_time_us(machine->hal) - timer->from_us);
}

bool timer_poll(struct machine *machine) {
    struct machine_clock *clock = &machine->clock;
    clock->quiet.on = timer_runs(machine, &clock->quiet);
    clock->timer.on = timer_runs(machine, &clock->timer);
    return clock->quiet.on;
}
