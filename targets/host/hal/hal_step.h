/* SPDX-License-Identifier: MIT
 * Hot tier of the host: a step timer in virtual time and pins that write a trace. Contract:
 * core/hal/README.md. */
#ifndef WIFICNC_HAL_STEP_H
#define WIFICNC_HAL_STEP_H

#include "base/axis.h"
#include "hal/compiler.h"
#include "trace.h"

#include <stdbool.h>

#define HAL_ISR /* no section of its own on a PC */

/** The virtual step timer and pins of one machine. */
struct hal_step {
    uint64_t now_ticks;   /* virtual time */
    uint64_t alarm_ticks; /* next event, while running */
    struct trace *trace;
    uint32_t line;    /* of the span being stepped */
    axis_mask_t dirs; /* level of the direction lines, 1 = negative */
    uint8_t flags;    /* SEGMENT_ flags of the span being stepped */
    bool running;
    bool probe;           /* level of the probe input */
    uint64_t step_events; /* events that stepped at least one axis */
};

static HAL_INLINE void hal_step_set(struct hal_step *hal, axis_mask_t axes) {
    if (axes == 0)
        return;
    struct trace *trace = hal->trace;
    trace->events[trace->count] = (struct trace_event){.t_ticks = hal->now_ticks,
                                                       .step_mask = axes,
                                                       .dir_mask = hal->dirs,
                                                       .flags = hal->flags,
                                                       .line = hal->line};
    hal->step_events++;
    if (++trace->count == TRACE_CHUNK)
        trace_flush(trace);
}

static HAL_INLINE void hal_step_clear(struct hal_step *hal) {
    (void)hal;
}

static HAL_INLINE void hal_step_direction(struct hal_step *hal, axis_mask_t negative) {
    hal->dirs = negative;
}

static HAL_INLINE bool hal_step_probe(const struct hal_step *hal) {
    return hal->probe;
}

static HAL_INLINE void hal_step_timer_start(struct hal_step *hal, uint32_t ticks) {
    hal->alarm_ticks = hal->now_ticks + ticks;
    hal->running = true;
}

static HAL_INLINE void hal_step_timer_next(struct hal_step *hal, uint32_t ticks) {
    hal->alarm_ticks += ticks;
}

static HAL_INLINE void hal_step_timer_stop(struct hal_step *hal) {
    hal->running = false;
}

static HAL_INLINE void hal_step_span(struct hal_step *hal, uint16_t flags, uint32_t line) {
    hal->flags = (uint8_t)flags;
    hal->line = line;
}

#endif
