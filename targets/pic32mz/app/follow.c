/* SPDX-License-Identifier: MIT */
#include "app/follow.h"

#include "app/board.h"

static void apply(struct follow *follow) {
    const struct settings *settings = machine_settings(follow->machine);
    step_engine_set_pulse(&follow->hal->step, machine_step_pulse_ns(follow->machine));
    step_engine_invert(&follow->hal->step, settings->step_invert_mask, settings->dir_invert_mask,
                       settings->second_dir_invert_mask);
    inputs_set_levels(&follow->hal->inputs,
                      (struct input_senses){.limit_invert = settings->limit_invert,
                                            .probe_invert = settings->probe_invert,
                                            .toolsetter_invert = settings->toolsetter_invert,
                                            .estop_normally_open = settings->estop_normally_open});
    follow->applied = *settings;
}

void follow_init(struct follow *follow, struct machine *machine, struct hal *hal) {
    *follow = (struct follow){.machine = machine, .hal = hal};
    apply(follow);
}

/* Not in motion: a changed polarity or pulse length would be an edge too many, or a pulse too short. */
void follow_poll(struct follow *follow) {
    const struct settings *now = machine_settings(follow->machine);
    if (settings_differ(now, &follow->applied, SETTING_AFFECTS_SIGNALS) &&
        machine_is_standing(follow->machine))
        apply(follow);
}
