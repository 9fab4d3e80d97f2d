/* SPDX-License-Identifier: MIT */
#include "app/follow.h"

static void apply_pulse(struct follow *follow) {
    step_engine_set_pulse(&follow->hal->step, machine_step_pulse_ns(follow->machine));
}

/* Outside of the interrupts of the inputs, not between them. */
static void apply_levels(void *arg) {
    const struct follow *follow = arg;
    const struct settings *settings = machine_settings(follow->machine);
    inputs_set_levels(&follow->hal->inputs, settings->limit_invert, settings->probe_invert,
                      settings->toolsetter_invert);
}

static void apply(struct follow *follow) {
    const struct machine_board *board = machine_board(follow->machine);
    const struct settings *settings = machine_settings(follow->machine);
    apply_pulse(follow);
    step_engine_invert(&follow->hal->step, settings->step_invert_mask, settings->dir_invert_mask,
                       settings->second_dir_invert_mask);
    if (board->motion_side == NULL)
        apply_levels(follow);
    else
        board->motion_side->call(board->motion_side_ctx, apply_levels, follow);
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
