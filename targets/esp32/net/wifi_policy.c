/* SPDX-License-Identifier: MIT */
#include "net/wifi_policy.h"

enum { FIRST_WAIT_MS = 1000, LONGEST_WAIT_MS = 60000, OWN_AFTER_MS = 60000 };

void wifi_policy_init(struct wifi_policy *policy, bool has_network, uint32_t now_ms) {
    *policy = (struct wifi_policy){
        .has_network = has_network, .own = !has_network, .lost_ms = now_ms, .apart_ms = now_ms};
}

void wifi_policy_join(struct wifi_policy *policy, bool has_network, uint32_t now_ms) {
    const bool hold = policy->hold, own = policy->own;
    wifi_policy_init(policy, has_network, now_ms);
    policy->hold = hold;
    policy->own |= hold && own;
}

void wifi_policy_hold(struct wifi_policy *policy, bool hold) {
    if (policy->hold && !hold && policy->connected)
        policy->own = !policy->has_network;
    policy->hold = hold;
}

/* A wrong password is not refused: the handshake ends without an answer. */
enum wifi_state wifi_policy_why(unsigned reason) {
    enum {
        AUTH_EXPIRED = 2,
        MIC_FAILURE = 14,
        NO_HANDSHAKE = 15,
        NO_AP = 201,
        AUTH_FAIL = 202,
        NO_HANDSHAKE_IDF = 204
    };
    enum { NO_AP_SECURITY = 210, NO_AP_AUTH = 211, NO_AP_RSSI = 212 };
    switch (reason) {
    case NO_AP:
    case NO_AP_RSSI:
        return WIFI_NOT_FOUND;
    case AUTH_EXPIRED:
    case MIC_FAILURE:
    case NO_HANDSHAKE:
    case AUTH_FAIL:
    case NO_HANDSHAKE_IDF:
    case NO_AP_SECURITY: /* it has another kind of password, or none */
    case NO_AP_AUTH:
        return WIFI_WRONG_PASSWORD;
    default:
        return WIFI_FAILED;
    }
}

void wifi_policy_event(struct wifi_policy *policy, enum wifi_event event, uint32_t now_ms) {
    if (event == WIFI_GOT_ADDRESS) {
        policy->connected = true;
        policy->trying = false;
        policy->own = !policy->has_network || (policy->hold && policy->own);
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
