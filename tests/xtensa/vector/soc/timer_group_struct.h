/* SPDX-License-Identifier: MIT
 * The step timer: a processor timer of level 5 stands for it, and each access sets its next interrupt. */
#pragma once

#include_next "soc/timer_group_struct.h"

#include "emulated.h"

extern timg_dev_t timer_group;

static inline timg_dev_t *emulated_timer_group(void) {
    uint32_t at = emulated_cycles() + emulated.least_cycles + (emulated_random() & emulated.spread_mask);
    __asm__ volatile("wsr %0, ccompare2" ::"r"(at)); /* ends the interrupt, too */
    emulated_note_origin();
    return &timer_group;
}

#define TIMERG0 (*emulated_timer_group())
