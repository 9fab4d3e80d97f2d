/* SPDX-License-Identifier: MIT
 * Step pulses by the RMT peripheral: axis n is channel n, and a pulse lies ready in its memory. The interrupt
 * only starts it, and the hardware ends it: nothing waits for its end, and its length is exact to 12.5 ns
 * whatever happens to the processor. Of hal_step.h.
 *
 * All channels stand when an event comes. So all are rewound, and then each is written with its axis' bit as
 * the start bit, which is bit 0: no branch, and the axes start three instructions apart. */
#ifndef WIFICNC_PULSE_RMT_H
#define WIFICNC_PULSE_RMT_H

#include "hal/rmt_registers.h"

#include <stddef.h>

#ifdef __XTENSA__
/* Without the memw that a compiler puts before each volatile store: the bus keeps the order of these. */
#define STEP_RMT_REWIND_ONE(channel, word)                                                                   \
    __asm__ volatile("s32i %0, %1, %2" ::"r"(word), "r"(&RMT),                                               \
                     "i"(offsetof(rmt_dev_t, STEP_RMT_CONF(channel)))                                        \
                     : "memory")
#define STEP_RMT_START_ONE(channel, word, axes)                                                              \
    do {                                                                                                     \
        uint32_t started;                                                                                    \
        __asm__ volatile("extui %0, %1, %5, 1\n\t"                                                           \
                         "or %0, %0, %2\n\t"                                                                 \
                         "s32i %0, %3, %4"                                                                   \
                         : "=&r"(started)                                                                    \
                         : "r"(axes), "r"(word), "r"(&RMT),                                                  \
                           "i"(offsetof(rmt_dev_t, STEP_RMT_CONF(channel))), "i"(channel)                    \
                         : "memory");                                                                        \
    } while (0)
#else
#define STEP_RMT_REWIND_ONE(channel, word) (RMT.STEP_RMT_CONF(channel) = (word))
#define STEP_RMT_START_ONE(channel, word, axes)                                                              \
    (RMT.STEP_RMT_CONF(channel) = (word) | ((axes) >> (channel) & 1u))
#endif

/* What is done for every axis of the board; of the others nothing is left. */
#define STEP_RMT_AXES(DO)                                                                                    \
    do {                                                                                                     \
        STEP_RMT_AXIS(0, DO);                                                                                \
        STEP_RMT_AXIS(1, DO);                                                                                \
        STEP_RMT_AXIS(2, DO);                                                                                \
        STEP_RMT_AXIS(3, DO);                                                                                \
        STEP_RMT_AXIS(4, DO);                                                                                \
        STEP_RMT_AXIS(5, DO);                                                                                \
    } while (0)
#define STEP_RMT_AXIS(axis, DO)                                                                              \
    if ((axis) < BOARD_AXIS_COUNT)                                                                           \
    DO((axis) < BOARD_AXIS_COUNT ? (axis) : 0)

/* A channel that is still at work must not be started. Prep leaves time enough between events; the wait is
 * for an interrupt that came late after one in time. It counts from before the first start, so it has
 * BOARD_STEP_SPREAD_NS in it. */
static HAL_INLINE void hal_step_set(struct hal_step *hal, axis_mask_t axes) {
    const uint32_t rewind = hal->rmt_rewind, rest = hal->rmt_rest, bits = axes;
    uint32_t now;
    do
        now = esp_cpu_get_cycle_count();
    while (now - hal->quiet_at < hal->quiet);
    hal->quiet_at = now;
#define REWIND(channel) STEP_RMT_REWIND_ONE(channel, rewind)
#define START(channel)  STEP_RMT_START_ONE(channel, rest, bits)
    STEP_RMT_AXES(REWIND);
    STEP_RMT_AXES(START);
    step_alarm_seen();
#undef REWIND
#undef START
}

static HAL_INLINE void hal_step_clear(struct hal_step *hal) {
    (void)hal;
}

/* A direction line must not change while a step line is high. Only when one does change. */
static HAL_INLINE void step_pulse_wait(const struct hal_step *hal) {
    while (esp_cpu_get_cycle_count() - hal->quiet_at < hal->pulse_end_cycles) {
    }
}

/* The same quiet time as behind a pulse: step_rmt_set_pulse() has made it long enough. */
static HAL_INLINE void step_direction_done(struct hal_step *hal) {
    hal->quiet_at = esp_cpu_get_cycle_count();
}

#endif
