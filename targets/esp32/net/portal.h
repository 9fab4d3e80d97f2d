/* SPDX-License-Identifier: MIT
 * First contact: a phone in the controller's own network is led to the page that sets the network up, and
 * /api/network of that page. [controller task] Plain C and BSD sockets: it is tested on a computer.
 *
 * Another network is on trial (device/device.h): the network before returns, unless someone comes through the
 * new one within DEVICE_TRIAL_S, as a client that may command, or with the ticket that the change was
 * answered with. Who is in the own network knows its password, and needs no access key here. */
#ifndef WIFICNC_ESP32_PORTAL_H
#define WIFICNC_ESP32_PORTAL_H

#include "device/device.h"
#include "net/wiring_page.h"
#include "net_http.h"
#include "net_hub.h"

struct portal_options {
    struct device *device;
    struct access *access;
    struct net_hub *hub;
    struct wiring_page *wiring; /* answers what is about pins; NULL: nothing does */
    const char *page;           /* address of the page that sets the network up */
    const char *address;        /* of our own network, numeric: names lead there */
    uint16_t dns_port;          /* NET_DNS_PORT outside of tests */
    /** Nothing moves: flash may be written, and the radio may be elsewhere for two seconds. */
    bool (*at_rest)(void *ctx);
    /** The clock of device_poll(). */
    uint64_t (*now_us)(void *ctx);
    void (*random)(void *ctx, uint8_t *bytes, size_t count);
    void *ctx;
};

struct portal;

/** [start] All that options point to outlives it. @return NULL: memory is short */
struct portal *portal_create(const struct portal_options *options);

/** As net_http_site.network. @param portal  struct portal */
bool portal_network(void *portal, const struct net_http_call *call, struct net_http_late *out);

/** As net_http_site.portal. */
const char *portal_page(void *portal, uint64_t here, uint64_t peer);

/** A round. */
void portal_poll(struct portal *portal);

#endif
