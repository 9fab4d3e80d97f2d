/* SPDX-License-Identifier: MIT
 * The interval of automatic status reports, as `$RI=` sets it: of a machine with one connection
 * (machine/auto_report.c), and of each client of a hub (targets/net). */
#ifndef WIFICNC_MACHINE_REPORT_INTERVAL_H
#define WIFICNC_MACHINE_REPORT_INTERVAL_H

#include "gcode/status.h"

#include <stdint.h>

enum { MIN_REPORT_INTERVAL_MS = 50, MAX_REPORT_INTERVAL_MS = 60000 };

/** Automatic reports of one connection; all zero is off. */
struct report_interval {
    uint16_t on_ms;   /* 0: off */
    uint16_t last_ms; /* what 0x8C turns on; 0: nothing */
};

/** `$RI=` with this text. What is refused changes nothing. */
static inline enum status report_interval_set(struct report_interval *interval, const char *text) {
    uint32_t ms = 0;
    if (*text == '\0')
        return STATUS_BAD_NUMBER;
    for (; *text >= '0' && *text <= '9' && ms <= MAX_REPORT_INTERVAL_MS; text++)
        ms = ms * 10 + (uint32_t)(*text - '0');
    if (*text != '\0' && !(*text >= '0' && *text <= '9'))
        return STATUS_BAD_NUMBER;
    if (ms != 0 && (ms < MIN_REPORT_INTERVAL_MS || ms > MAX_REPORT_INTERVAL_MS))
        return STATUS_REPORT_INTERVAL;
    interval->on_ms = (uint16_t)ms;
    if (ms != 0)
        interval->last_ms = (uint16_t)ms;
    return STATUS_OK;
}

/** 0x8C: off, or on as before. As in grblHAL, it does nothing where no interval was set. */
static inline void report_interval_toggle(struct report_interval *interval) {
    interval->on_ms = interval->on_ms == 0 ? interval->last_ms : 0;
}

#endif
