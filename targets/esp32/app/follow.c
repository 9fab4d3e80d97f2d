/* SPDX-License-Identifier: MIT */
#include "app/follow.h"

#include "settings/settings.h"

#include <string.h>

_Static_assert(sizeof(struct follow_signals) == 10, "no padding");

static struct input_senses senses_of(const struct settings *settings) {
    return (struct input_senses){.limit_invert = settings->limit_invert,
                                 .probe_invert = settings->probe_invert,
                                 .toolsetter_invert = settings->toolsetter_invert,
                                 .estop_normally_open = settings->estop_normally_open};
}

static struct follow_signals wanted(const struct follow *follow) {
    const struct settings *settings = machine_settings(follow->machine);
    return (struct follow_signals){.pulse_us = settings->step_pulse_us,
                                   .step_invert = settings->step_invert_mask,
                                   .dir_invert = settings->dir_invert_mask,
                                   .second_dir_invert = settings->second_dir_invert_mask,
                                   .reserved = 0,
                                   .senses = senses_of(settings)};
}

static void apply_pulse(struct follow *follow) {
    step_engine_set_pulse(&follow->hal->step, machine_step_pulse_ns(follow->machine));
}

/* Outside of the interrupts of the inputs, not between them. */
static void apply_levels(void *arg) {
    const struct follow *follow = arg;
    inputs_set_levels(&follow->hal->inputs, senses_of(machine_settings(follow->machine)));
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
    follow->applied = wanted(follow);
}

void follow_init(struct follow *follow, struct machine *machine, struct hal *hal) {
    *follow = (struct follow){.machine = machine, .hal = hal};
    apply(follow);
}

/* Not in motion: a changed polarity or pulse length would be an edge too many, or a pulse too short. */
void follow_poll(struct follow *follow) {
    const struct follow_signals now = wanted(follow);
    if (memcmp(&now, &follow->applied, sizeof now) != 0 && machine_is_standing(follow->machine))
        apply(follow);
}
