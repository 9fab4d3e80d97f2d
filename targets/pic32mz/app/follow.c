/* SPDX-License-Identifier: MIT */
#include "app/follow.h"

#include "app/board.h"

#define MOTORS_STAY_ON 255u /* $1: as in Grbl */
#define US_PER_MS      1000u
#define WAKE_US        1000u /* drivers need up to a ms to wake */

static void apply(struct follow *follow) {
    const struct settings *settings = &follow->machine->settings;
    step_engine_set_pulse(&follow->hal->step, machine_step_pulse_ns(follow->machine));
    step_engine_invert(&follow->hal->step, settings->step_invert_mask, settings->dir_invert_mask);
    inputs_set_levels(&follow->hal->inputs, settings->limit_invert, settings->probe_invert);
    outputs_motors(&follow->hal->outputs, follow->motors_on, settings->enable_invert);
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
           now->probe_invert != before->probe_invert || now->enable_invert != before->enable_invert;
}

static void switch_motors(struct follow *follow, bool on) {
    follow->motors_on = on;
    follow->switched_us = system_time_us();
    outputs_motors(&follow->hal->outputs, on, follow->machine->settings.enable_invert);
}

static void follow_motion(struct follow *follow) {
    uint16_t delay_ms = follow->machine->settings.idle_delay_ms;
    uint32_t now_us = system_time_us();
    if (!machine_is_at_rest(follow->machine)) {
        follow->rested_us = now_us;
        if (!follow->motors_on)
            switch_motors(follow, true);
    } else if (follow->motors_on && delay_ms != MOTORS_STAY_ON &&
               now_us - follow->rested_us >= delay_ms * US_PER_MS) {
        switch_motors(follow, false);
    }
}

bool follow_poll(struct follow *follow) {
    follow_motion(follow);
    if (has_changed(follow) && machine_is_standing(follow->machine))
        apply(follow);
    return follow->motors_on && system_time_us() - follow->switched_us >= WAKE_US;
}
