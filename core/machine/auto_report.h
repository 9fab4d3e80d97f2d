/* SPDX-License-Identifier: MIT
 * Automatic status reports to the one connection of a machine without a hub. [task] */
#ifndef WIFICNC_MACHINE_AUTO_REPORT_H
#define WIFICNC_MACHINE_AUTO_REPORT_H

#include "machine/machine.h"
#include "machine/report_interval.h"
#include "machine/timer.h"

struct machine_auto_report {
    struct report_interval interval;
    struct machine_timer next;
};

/** `$RI=` with this text. */
enum status auto_report_set(struct machine *machine, const char *text);

/** 0x8C */
void auto_report_toggle(struct machine *machine);

/** A reset ends them. */
static inline void auto_report_forget(struct machine_auto_report *reports) {
    *reports = (struct machine_auto_report){.next.on = false};
}

/** Ask for a report when one is due, as `?` does: several that find no room are one. */
void auto_report_poll(struct machine *machine);

/** Until the next one; UINT32_MAX: they are off. */
uint32_t auto_report_wait_us(const struct machine *machine);

#endif
