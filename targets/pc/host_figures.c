/* SPDX-License-Identifier: MIT
 * Figures of the controller: what it has counted, and its settings that measuring needs. */
#include "host_inner.h"

#include <string.h>

void host_counters(const struct host *host, struct host_counters *out) {
    const struct machine *machine = &host->machine;
    *out = (struct host_counters){
        .step_events = host->trace.total + host->trace.count,
        .timer_events = host->timer_events,
        .segments = machine->drive.prep.segments,
        .spans = machine->drive.step.spans_done,
        .blocks = machine->drive.motion.plan.moves_total,
        .lines = machine->lines.count,
        .lookahead_starved = machine->drive.motion.emit.starved,
        .underruns = machine->drive.motion.ahead.late,
        .plan_unmet = machine->drive.motion.plan.timing.unmet,
    };
}

void host_steps_per_mm(const struct host *host, float out[AXIS_COUNT]) {
    memcpy(out, host->machine.settings.steps_per_mm, sizeof host->machine.settings.steps_per_mm);
}

bool host_store_is_damaged(const struct host *host) {
    return stored_is_damaged(&host->machine);
}

size_t host_core_ram_bytes(void) {
    return sizeof(struct machine);
}
