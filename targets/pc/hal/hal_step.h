/* SPDX-License-Identifier: MIT
 * Hot tier of the host: a step timer in virtual time and pins that write a trace. Contract:
 * core/hal/README.md. */
#ifndef WIFICNC_HAL_STEP_H
#define WIFICNC_HAL_STEP_H

#include "base/axis.h"
#include "hal/compiler.h"
#include "segment/segment.h"
#include "trace.h"

#include <stdbool.h>
#include <string.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "a trace event is written as two words");

#define HAL_ISR /* no section of its own on a PC */

/** The virtual step timer and pins of one machine. */
struct hal_step {
    uint64_t now_ticks;        /* virtual time */
    uint64_t alarm_ticks;      /* next event, while running */
    struct trace_event *write; /* where the next event goes; host.c sees to room */
    uint64_t tag;              /* second word of the next trace_event, without its step_mask */
    bool running;
    bool probe;    /* level of the probe input */
    uint16_t duty; /* of the PWM output while it is a laser's */
};

static HAL_INLINE void hal_step_set(struct hal_step *hal, axis_mask_t axes) {
    if (axes == 0)
        return;
    char *event = (char *)hal->write++;
    uint64_t word = hal->tag | axes;
    memcpy(event + sizeof word, &word, sizeof word);
    memcpy(event, &hal->now_ticks, sizeof hal->now_ticks);
}

static HAL_INLINE void hal_step_clear(struct hal_step *hal) {
    (void)hal;
}

static HAL_INLINE void hal_step_direction(struct hal_step *hal, axis_mask_t negative) {
    hal->tag = (hal->tag & ~(uint64_t)0xFF00) | (uint64_t)negative << 8;
}

static HAL_INLINE void hal_step_duty(struct hal_step *hal, uint32_t value) {
    hal->duty = (uint16_t)value;
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
    uint64_t dwells = (hal->tag >> 24) + ((flags & SEGMENT_DWELL) != 0);
    hal->tag =
        (hal->tag & 0xFF00) | (uint64_t)(uint8_t)flags << 16 | (dwells & 0xFF) << 24 | (uint64_t)line << 32;
}

#endif
