/* SPDX-License-Identifier: MIT
 * Levels of inputs without their bouncing. [isr and task of one core] No clock and no register of its own.
 *
 * An input switches on at its first edge when `on_us` is 0 (switches that must stop the machine), or after it
 * has been on for that long (buttons); it goes off only after it has been off for `off_us` (contacts bounce,
 * cables catch noise). What was on or off for less than its time is a glitch, and is counted. */
#ifndef WIFICNC_BASE_DEBOUNCE_H
#define WIFICNC_BASE_DEBOUNCE_H

#include <stdbool.h>
#include <stdint.h>

enum { DEBOUNCE_INPUTS = 32 };

/** How long an input must stay on or off to count, us; 0 = its first edge counts. */
struct debounce_time {
    uint16_t on_us, off_us;
};

struct debounce {
    struct debounce_time time[DEBOUNCE_INPUTS];
    uint32_t since_us[DEBOUNCE_INPUTS]; /* of a change that waits: when it began */
    uint32_t raw;                       /* at the last sample, bit n = input n is on */
    uint32_t stable;                    /* without bouncing */
    uint32_t glitches[DEBOUNCE_INPUTS];
};

/** All inputs stand where they are: no edge is behind them. time[] is kept. */
void debounce_start(struct debounce *debounce, uint32_t raw);

/** A sample, at an edge and every ms or so. @param now_us  wraps @return inputs that have changed for good */
uint32_t debounce_sample(struct debounce *debounce, uint32_t raw, uint32_t now_us);

#endif
