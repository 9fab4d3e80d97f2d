/* SPDX-License-Identifier: MIT
 * A new firmware is on trial: the old one returns unless someone who may command reaches it over the network.
 * [task] Pure: the target confirms it or restarts into the old one. A reset during the trial returns to the
 * old one, too: that is the bootloader's. */
#ifndef WIFICNC_ESP32_UPDATE_TRIAL_H
#define WIFICNC_ESP32_UPDATE_TRIAL_H

#include <stdbool.h>
#include <stdint.h>

/** UPDATE_STEADY_S: it runs without a crash that long before it counts. */
enum { UPDATE_TRIAL_S = 300, UPDATE_STEADY_S = 30 };

enum update_verdict { UPDATE_WAIT, UPDATE_CONFIRM, UPDATE_REVERT };

struct update_trial {
    bool on;      /* the firmware that runs is not confirmed */
    bool reached; /* over the network, by someone who may command */
};

/** Each round, from the start on. CONFIRM and REVERT come once.
 * @param up_us  since the start; the trial is over before it wraps
 * @param reached  someone who may command is connected over the network
 * @param at_rest  the machine does nothing that a restart would end */
enum update_verdict update_trial_poll(struct update_trial *trial, uint32_t up_us, bool reached, bool at_rest);

#endif
