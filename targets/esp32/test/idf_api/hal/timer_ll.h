/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's hal/timer_ll.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "soc/timer_group_struct.h"

#include <stdbool.h>

typedef enum { GPTIMER_CLK_SRC_APB } gptimer_clock_source_t;

#define TIMER_LL_EVENT_ALARM(timer) (1 << (timer))

void timer_ll_enable_bus_clock(int group, bool enable);
void timer_ll_reset_register(int group);
void timer_ll_enable_clock(int group, uint32_t timer, bool enable);
void timer_ll_set_clock_source(int group, uint32_t timer, gptimer_clock_source_t source);
void timer_ll_enable_intr(timg_dev_t *hw, uint32_t mask, bool enable);
