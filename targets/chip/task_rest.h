/* SPDX-License-Identifier: MIT
 * A task that always finds work blocks for a tick all the same, at least every ESP32_WORK_MAX_US. Else tasks
 * of lower priority starve: the network's, and the idle task, which has to be seen by ESP-IDF's task watchdog
 * within 3 s. The firmware's tasks, and those of the PC in their times. [task] Pure. */
#ifndef WIFICNC_CHIP_TASK_REST_H
#define WIFICNC_CHIP_TASK_REST_H

#include "task_periods.h"

#include <stdbool.h>
#include <stdint.h>

/** Of one task. */
struct task_rest {
    uint32_t since_us; /* the end of its newest rest */
};

/** It must block now, whatever waits. @param now_us  wraps */
static inline bool task_rest_is_due(const struct task_rest *rest, uint32_t now_us) {
    return now_us - rest->since_us >= ESP32_WORK_MAX_US;
}

/** It has blocked until now_us. */
static inline void task_rest_end(struct task_rest *rest, uint32_t now_us) {
    rest->since_us = now_us;
}

#endif
