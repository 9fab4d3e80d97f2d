/* SPDX-License-Identifier: MIT */
#include "net/wifi_policy.h"

enum { FIRST_WAIT_MS = 1000, LONGEST_WAIT_MS = 60000, OWN_AFTER_MS = 60000 };

void wifi_policy_init(struct wifi_policy *policy, bool has_network, uint32_t now_ms) {
    *policy = (struct wifi_policy){
        .has_network = has_network, .own = !has_network, .lost_ms = now_ms, .apart_ms = now_ms};
}

void wifi_policy_event(struct wifi_policy *policy, enum wifi_event event, uint32_t now_ms) {
    if (event == WIFI_GOT_ADDRESS) {
        policy->connected = true;
        policy->trying = false;
        policy->own = !policy->has_network;
        /* The next loss begins with the shortest wait again. */
        policy->wait_ms = 0;
        return;
    }
    if (policy->connected)
        policy->apart_ms = now_ms;
    if (policy->connected || policy->trying) {
        uint32_t longer_ms = policy->wait_ms == 0 ? FIRST_WAIT_MS : 2 * policy->wait_ms;
        policy->wait_ms = longer_ms < LONGEST_WAIT_MS ? longer_ms : LONGEST_WAIT_MS;
        policy->lost_ms = now_ms;
    }
    policy->connected = policy->trying = false;
}

struct wifi_action wifi_policy_poll(struct wifi_policy *policy, uint32_t now_ms) {
    struct wifi_action action = {.connect = false, .own = policy->own};
    if (!policy->has_network || policy->connected)
        return action;
    if (now_ms - policy->apart_ms >= OWN_AFTER_MS)
        action.own = policy->own = true;
    action.connect = !policy->trying && now_ms - policy->lost_ms >= policy->wait_ms;
    policy->trying |= action.connect;
    return action;
}
