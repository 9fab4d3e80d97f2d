/* SPDX-License-Identifier: MIT
 * Automatic status reports to the one connection of a machine without a hub. */
#include "machine/auto_report.h"

#include "machine/parts.h"

#define US_PER_MS 1000u

static void restart(struct machine *machine) {
    timer_start(machine, &machine->auto_report.next, machine->auto_report.interval.on_ms * US_PER_MS);
}

enum status auto_report_set(struct machine *machine, const char *text) {
    const enum status status = report_interval_set(&machine->auto_report.interval, text);
    if (status == STATUS_OK)
        restart(machine);
    return status;
}

void auto_report_toggle(struct machine *machine) {
    report_interval_toggle(&machine->auto_report.interval);
    restart(machine);
}

void auto_report_poll(struct machine *machine) {
    const struct machine_auto_report *reports = &machine->auto_report;
    if (!reports->next.on || timer_runs(machine, &reports->next))
        return;
    rx_request(&machine->lines.rx, REALTIME_STATUS);
    restart(machine);
}

uint32_t auto_report_wait_us(const struct machine *machine) {
    return timer_left_us(machine, &machine->auto_report.next);
}
