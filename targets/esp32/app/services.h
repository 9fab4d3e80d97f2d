/* SPDX-License-Identifier: MIT
 * What the network is offered in addition to telnet: updates and a name. [task, core 0] For motion controller
 * and I/O module alike. */
#ifndef WIFICNC_ESP32_SERVICES_H
#define WIFICNC_ESP32_SERVICES_H

#include "net/ota_flash.h"
#include "net/update_trial.h"
#include "net_mdns.h"

#include <stdbool.h>
#include <stdint.h>

struct services {
    struct ota_flash flash;
    struct ota ota;
    struct net_mdns mdns;
    int ota_listener, mdns_socket; /* -1: not there */
    uint32_t address;              /* announced */
    uint32_t done_us;              /* when an update was complete */
    uint32_t now_us;               /* of the last round */
    struct update_trial trial;
    bool restarts;
};

/** [start, behind network_start()] @param access  whose key updates need; outlives this
 * @param flash  who is asked before flash is written; is copied
 * @param telnet_port  that is announced in the network; 0: there is no telnet */
void services_start(struct services *services, struct access *access, const struct ota_flash *flash,
                    uint16_t telnet_port);

/** [start] The web page is served at this port: it is announced in the network, too. */
void services_announce_page(struct services *services, uint16_t port);

/** Someone sends a new firmware. @param services  struct services @param stream  is owned from here on */
void services_update(void *services, const struct net_stream *stream);

/** Restart the chip soon: an answer that is on its way goes out first. */
void services_restart(struct services *services);

/** One round. Restarts the chip when a new firmware is complete, and into the old one when no one has reached
 * the new one (net/update_trial.h). @param reached  someone who may command is connected over the network
 * @param at_rest  the machine does nothing @return true: there is more to do immediately */
bool services_poll(struct services *services, uint32_t now_us, bool reached, bool at_rest);

#endif
