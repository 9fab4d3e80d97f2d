/* SPDX-License-Identifier: MIT */
#include "net/update_trial.h"

#define US_PER_S 1000000u

enum update_verdict update_trial_poll(struct update_trial *trial, uint32_t up_us, bool reached,
                                      bool at_rest) {
    if (!trial->on)
        return UPDATE_WAIT;
    trial->reached |= reached;
    const bool confirm = trial->reached && up_us >= UPDATE_STEADY_S * US_PER_S;
    const bool revert = !trial->reached && up_us >= UPDATE_TRIAL_S * US_PER_S && at_rest;
    trial->on = !confirm && !revert;
    return confirm ? UPDATE_CONFIRM : revert ? UPDATE_REVERT : UPDATE_WAIT;
}
