/* SPDX-License-Identifier: MIT
 * Overrides of feed, rapids and spindle, in percent. */
#include "machine/overrides.h"

#include "machine/parts.h"
#include "machine/report.h"

static uint8_t change(uint8_t percent, int by) {
    int value = by == 0 ? 100 : percent + by;
    return (uint8_t)(value < 10 ? 10 : value > 200 ? 200 : value);
}

bool overrides_take(struct machine_overrides *overrides, int byte) {
    static const int8_t by[] = {0, 10, -10, 1, -1};
    static const uint8_t rapid[] = {100, 50, 25};
    if (byte == RX_OPTIONAL_STOP) {
        overrides->optional_stop = !overrides->optional_stop;
        return true;
    }
    if (byte < 0x90 || byte == 0x98 || byte > 0x9D)
        return false;
    if (byte <= 0x94)
        overrides->feed_pct = change(overrides->feed_pct, by[byte - 0x90]);
    else if (byte <= 0x97)
        overrides->rapid_pct = rapid[byte - 0x95];
    else
        overrides->spindle_pct = change(overrides->spindle_pct, by[byte - 0x99]);
    return true;
}

static bool is_on(const struct machine *machine, uint8_t levels) {
    const unsigned wired = (1u << machine->board.digital_inputs) - 1u;
    return ((levels ^ machine->settings.m1_invert) & machine->settings.m1_inputs & wired) != 0;
}

void overrides_see_switch(struct machine *machine, uint8_t before) {
    machine->overrides.switched = is_on(machine, before) || is_on(machine, machine->inputs.digital);
}

uint8_t overrides_feed_pct(const struct machine *machine) {
    return (machine->interp.gcode.modal.overrides & OVERRIDE_FEED) != 0 ? machine->overrides.feed_pct : 100;
}

static float feed_factor(const struct machine *machine) {
    const struct machine_spindle_sync *thread = &machine->spindle_sync;
    return thread->per_rev_nominal > 0.0f ? thread->per_rev_factor : 1.0f;
}

void overrides_apply(struct machine *machine) {
    /* As in Grbl. The state must have been changed before this is called. */
    bool plain = machine->life.state == MACHINE_JOG || machine->life.state == MACHINE_HOME ||
                 machine->task.stage == TASK_PROBING;
    float feed = plain ? 1.0f : (float)overrides_feed_pct(machine) * 0.01f * feed_factor(machine);
    float rapid = plain ? 1.0f : (float)machine->overrides.rapid_pct * 0.01f;
    motion_set_override(&machine->drive.motion, feed, rapid);
}

void overrides_reset(struct machine *machine) {
    overrides_begin(&machine->overrides);
    overrides_apply(machine);
    report_changed_override(machine);
}
