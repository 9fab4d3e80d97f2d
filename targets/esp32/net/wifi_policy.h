/* SPDX-License-Identifier: MIT
 * When to try the network again, and when to open a network of our own. [task] Pure: no clock, no radio.
 *
 *   no network name stored      -> own network immediately
 *   connecting fails or is lost -> again after 1 s, 2 s, 4 s ... 60 s
 *   not connected for a minute  -> own network as well, while the tries continue; off again when connected
 *   another network is tried    -> an own network that is up stays until the trial ends: a phone in it shows
 *                                  how it went */
#ifndef WIFICNC_ESP32_WIFI_POLICY_H
#define WIFICNC_ESP32_WIFI_POLICY_H

#include <stdbool.h>
#include <stdint.h>

enum wifi_event { WIFI_GOT_ADDRESS, WIFI_LOST };

/** How it is with the stored network. */
enum wifi_state {
    WIFI_NO_NETWORK, /* none is stored */
    WIFI_JOINING,
    WIFI_JOINED,
    WIFI_NOT_FOUND,
    WIFI_WRONG_PASSWORD,
    WIFI_FAILED
};

/** What is to be done now. */
struct wifi_action {
    bool connect; /* try the stored network */
    bool own;     /* our own network is to be up */
};

struct wifi_policy {
    bool has_network; /* a name is stored */
    bool connected;
    bool trying;       /* an attempt is under way */
    uint32_t wait_ms;  /* until the next attempt, counted from lost_ms */
    uint32_t lost_ms;  /* when the last attempt failed or the connection was lost */
    uint32_t apart_ms; /* since when there is no connection */
    bool own;
    bool hold; /* another network is on trial */
};

void wifi_policy_init(struct wifi_policy *policy, bool has_network, uint32_t now_ms);

/** Another network is stored, or none. An own network that is held stays. */
void wifi_policy_join(struct wifi_policy *policy, bool has_network, uint32_t now_ms);

/** @param hold  a network is on trial */
void wifi_policy_hold(struct wifi_policy *policy, bool hold);

/** Why a connection was lost. @param reason  the driver's number (IEEE 802.11, ESP-IDF from 200 on) */
enum wifi_state wifi_policy_why(unsigned reason);

void wifi_policy_event(struct wifi_policy *policy, enum wifi_event event, uint32_t now_ms);

/** Ask every 100 ms or so. */
struct wifi_action wifi_policy_poll(struct wifi_policy *policy, uint32_t now_ms);

#endif
