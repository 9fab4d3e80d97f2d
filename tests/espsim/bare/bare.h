/* SPDX-License-Identifier: MIT
 * What stands for the rest of the HAL and for ESP-IDF in the program without an operating system. */
#pragma once

#include "hal/hal.h"
#include "hal/step_engine.h"

struct hal {
    struct hal_step step;
    uint32_t seen_cycles; /* CCOUNT at the newest look */
    uint64_t cycles;
};

/** Step and direction pins become outputs. */
void bare_outputs(const struct step_engine_board *board);

/** Sleep. @param us  of hal_time_us() */
void bare_wait_until(struct hal *hal, uint32_t us);
