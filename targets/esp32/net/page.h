/* SPDX-License-Identifier: MIT
 * The page that the firmware carries, at port 80. [controller task] The files lie in flash as they were
 * packed. */
#ifndef WIFICNC_ESP32_PAGE_H
#define WIFICNC_ESP32_PAGE_H

#include "net_hub.h"

/** Names of the page; they outlive it. */
struct page_names {
    const char *own;    /* of the controller in its networks */
    const char *others; /* net_http_site.names */
};

/** Listen. @param hub  browsers become its clients
 *  @param host  NULL: all networks
 *  @param port  "80"
 *  @return false: *error is an errno */
bool page_start(struct net_hub *hub, const char *host, const struct page_names *names, const char *port,
                int *error);

/** A round. @return true: there is more to do immediately */
bool page_poll(uint32_t now_us);

#endif
