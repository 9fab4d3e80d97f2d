/* SPDX-License-Identifier: MIT
 * Counts crashes in a row, in memory that a reset keeps and a power cut does not: after three of them the
 * controller starts in safe mode, with its links up and its motion locked. [start, task] Pure. */
#ifndef WIFICNC_ESP32_BOOT_GUARD_H
#define WIFICNC_ESP32_BOOT_GUARD_H

#include <stdbool.h>
#include <stdint.h>

enum { BOOT_CRASHES_ALLOWED = 3, BOOT_HEALTHY_AFTER_MS = 30000 };

enum boot_cause {
    BOOT_POWER,    /* also the reset button */
    BOOT_SOFTWARE, /* asked for: an update, a new configuration */
    BOOT_CRASH,    /* panic or watchdog */
    BOOT_BROWNOUT, /* the supply dipped: not the firmware's fault */
};

/** In memory that is not cleared at a reset; its content is anything after power-on. */
struct boot_guard {
    uint32_t magic;
    uint32_t crashes; /* in a row */
    uint32_t check;   /* ~crashes */
};

/** [start] Note this start. @return true: safe mode */
bool boot_guard_begin(struct boot_guard *kept, enum boot_cause cause);

/** The firmware has worked for BOOT_HEALTHY_AFTER_MS: earlier crashes do not count any more. */
void boot_guard_healthy(struct boot_guard *kept);

#endif
