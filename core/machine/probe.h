/* SPDX-License-Identifier: MIT
 * G38.2 .. G38.5. The step ISR remembers the exact step at which the probe changed; then the motion slows
 * down along its path and rests a little behind it. [task] */
#ifndef WIFICNC_MACHINE_PROBE_H
#define WIFICNC_MACHINE_PROBE_H

#include "config.h"
#include "machine/machine.h"

/** What the last G38 found. */
struct machine_probe {
    int32_t steps[AXIS_COUNT];
    bool ok;
};

/** Nothing was found. */
static inline void probe_forget(struct machine_probe *probe) {
    *probe = (struct machine_probe){.ok = false};
}

/** @return TASK_PROBE while something still moves, TASK_PROBING, or TASK_ALARMED: contact before it began */
enum task_stage probe_begin(struct machine *machine);

/** The present line is a G38.2 or G38.4, and it did not find what it looked for. */
bool probe_has_failed(const struct machine *machine);

/** @return TASK_PROBED when it is over */
enum task_stage probe_poll(struct machine *machine);

#endif
