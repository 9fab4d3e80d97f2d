/* SPDX-License-Identifier: MIT */
#include "app/follow.h"

#include "app/board.h"

static void apply(struct follow *follow) {
    const struct settings *settings = &follow->machine->settings;
    step_engine_set_pulse(&follow->hal->step, machine_step_pulse_ns(follow->machine));
    step_engine_invert(&follow->hal->step, settings->step_invert_mask, settings->dir_invert_mask);
    inputs_set_levels(&follow->hal->inputs, settings->limit_invert, settings->probe_invert);
    follow->applied = *settings;
}

void follow_init(struct follow *follow, struct machine *machine, struct hal *hal) {
    *follow = (struct follow){.machine = machine, .hal = hal};
    apply(follow);
}

static bool has_changed(const struct follow *follow) {
    const struct settings *now = &follow->machine->settings, *before = &follow->applied;
    return now->step_pulse_us != before->step_pulse_us || now->step_invert_mask != before->step_invert_mask ||
           now->dir_invert_mask != before->dir_invert_mask || now->limit_invert != before->limit_invert ||
           now->probe_invert != before->probe_invert;
}

void follow_poll(struct follow *follow) {
    if (has_changed(follow) && machine_is_standing(follow->machine))
        apply(follow);
}
