/* SPDX-License-Identifier: MIT */
#include "net/link_policy.h"

void link_policy_init(struct link_policy *policy, bool has_ethernet, uint32_t now_ms) {
    *policy = (struct link_policy){.wifi = !has_ethernet, .since_ms = now_ms};
}

void link_policy_ethernet(struct link_policy *policy, bool up, uint32_t now_ms) {
    if (policy->ethernet != up)
        policy->since_ms = now_ms;
    policy->ethernet = up;
}

bool link_policy_wifi(struct link_policy *policy, uint32_t now_ms) {
    /* Only after the cable has been as it is for a while: a short break must not start the radio. */
    if (policy->wifi == policy->ethernet && now_ms - policy->since_ms >= LINK_SETTLES_MS)
        policy->wifi = !policy->ethernet;
    return policy->wifi;
}
