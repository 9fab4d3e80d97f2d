/* SPDX-License-Identifier: MIT
 * What stands for the rest of the HAL and for ESP-IDF in the program without an operating system. */
#pragma once

#include "hal/hal.h"
#include "hal/step_engine.h"

struct hal {
    struct hal_step step;
    uint32_t seen_cycles; /* CCOUNT at the newest look */
    uint64_t cycles;
    bool two_cores; /* time is of a timer that both cores read */
};

/** Step and direction pins become outputs. */
void bare_outputs(const struct step_engine_board *board);

/** Of the timer that both cores read. */
uint32_t bare_timer_us(void);

/** Sleep. @param us  of hal_time_us() */
void bare_wait_until(struct hal *hal, uint32_t us);

/** Start the other core with this function, which does not return. */
void bare_start_core1(void (*run)(void));

/** [core 1] Until core 0 has written flash, when it asks: what ESP-IDF does to the other core meanwhile. In
 * IRAM: the cache is off, and only the step interrupt works. */
void bare_stall(void);

/** [core 0] Stall core 1, turn the cache off, erase a sector of the flash chip or write a page of it. */
void bare_write_flash(bool erases);
